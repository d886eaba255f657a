//! Profiles of a stored scan, frame by frame, computed from its peaks.

use axum::Json;
use axum::extract::State;
use optics::{Calibration, Triangulator};
use scanning::files::peaks::Peaks;
use scanning::label_frame;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::app::App;
use crate::http::conversions::blocking;
use crate::http::dto::profiles::{ProfileDto, ProfileListDto, ProfilePlaceDto};
use crate::http::extract::ApiPath;
use crate::problem::{Problem, ProblemKind};
use crate::stored_calibration::stored_document;
use crate::stored_scan::stored_peaks;

/// The routes.
pub fn routes() -> OpenApiRouter<App> {
    OpenApiRouter::new().routes(routes!(list_profiles)).routes(routes!(get_profile))
}

async fn peaks(app: &App, scan_id: &str) -> Result<(store::ScanRecord, Peaks), Problem> {
    let scan = app.ledger.read().scan(scan_id).await?;
    let peaks = stored_peaks(&*app.artifacts, &scan).await?;
    Ok((scan, peaks))
}

/// Where the frames of a scan were taken.
#[utoipa::path(
    get, path = "/scans/{id}/profiles", tag = "scans", params(("id" = String, Path)),
    responses((status = 200, body = ProfileListDto))
)]
async fn list_profiles(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
) -> Result<Json<ProfileListDto>, Problem> {
    let (_, peaks) = peaks(&app, &id).await?;
    let place = |(sequence, frame): (u32, &scanning::ScanFrame)| ProfilePlaceDto {
        sequence,
        position_mm: frame.position_mm,
        href: format!("/api/v1/scans/{id}/profiles/{sequence}"),
    };
    Ok(Json(ProfileListDto { items: (0..).zip(&peaks.frames).map(place).collect() }))
}

/// The profile of one frame: all orders, labelled by this frame alone; the cloud's labels also use its neighbours.
#[utoipa::path(
    get, path = "/scans/{id}/profiles/{sequence}", tag = "scans",
    params(("id" = String, Path), ("sequence" = u32, Path, description = "Frame of the scan, from 0")),
    responses((status = 200, body = ProfileDto))
)]
async fn get_profile(
    State(app): State<App>,
    ApiPath((id, sequence)): ApiPath<(String, u32)>,
) -> Result<Json<ProfileDto>, Problem> {
    let (scan, peaks) = peaks(&app, &id).await?;
    let document = stored_document(&app.ledger, &*app.artifacts, Some(&scan.calibration_id)).await?;
    let n_frames = peaks.frames.len();
    let made = blocking(move || profile(&peaks, sequence, &document.calibration())).await?;
    made.map(Json).ok_or_else(|| {
        Problem::new(ProblemKind::NotFound, format!("the scan has {n_frames} frames, there is no {sequence}"))
            .remedy("frames are counted from 0")
    })
}

fn profile(peaks: &Peaks, sequence: u32, calibration: &Calibration) -> Option<ProfileDto> {
    let idx = usize::try_from(sequence).ok()?;
    let frame = peaks.frames.get(idx)?;
    let triangulator = Triangulator::new(calibration.clone());
    let profile = label_frame(&frame.centrelines, &triangulator, calibration.depth_range_mm);
    let captured_at_ns = peaks.captured_at_ns.get(idx).copied().flatten();
    Some(ProfileDto::new(sequence, frame.position_mm, captured_at_ns, &calibration.id, &profile))
}
