//! Profiles of a stored scan, frame by frame, computed from its peaks.

use crate::Http;
use axum::Json;
use axum::extract::State;
use optics::{StagePosition, Triangulator};
use scanning::label_frame;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::{Problem, ProblemKind};
use crate::rest::conversions::blocking;
use crate::rest::extract::ApiPath;
use crate::wire::scan::profiles::{ProfileDto, ProfileItemDto, ProfileListDto};
use app::App;
use app::calibrations::stored::stored_document;
use app::stored_scan::{stored_frame, stored_positions};

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new().routes(routes!(list_profiles)).routes(routes!(get_profile))
}

/// Lists the frames of a scan with their stage positions.
#[utoipa::path(
    get, path = "/scans/{id}/profiles", tag = "scans", params(("id" = String, Path)),
    responses((status = 200, body = ProfileListDto))
)]
async fn list_profiles(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
) -> Result<Json<ProfileListDto>, Problem> {
    let scan = app.catalogue.read().scan(&id).await?;
    let positions = stored_positions(&*app.artifacts, &scan).await?;
    let place = |(sequence, position): (u32, StagePosition)| ProfileItemDto {
        sequence,
        position_mm: position.mm(),
        angle_deg: position.deg(),
        href: format!("/api/v1/scans/{id}/profiles/{sequence}"),
    };
    Ok(Json(ProfileListDto { items: (0..).zip(positions).map(place).collect() }))
}

/// Returns the profile of one frame with all orders, labelled from this frame alone; the labels of the cloud also use the
/// neighbouring frames.
#[utoipa::path(
    get, path = "/scans/{id}/profiles/{sequence}", tag = "scans",
    params(("id" = String, Path), ("sequence" = u32, Path, description = "Index of the frame, from 0")),
    responses((status = 200, body = ProfileDto))
)]
async fn get_profile(
    State(app): State<App>,
    ApiPath((id, sequence)): ApiPath<(String, u32)>,
) -> Result<Json<ProfileDto>, Problem> {
    let scan = app.catalogue.read().scan(&id).await?;
    let document = stored_document(&app.catalogue, &*app.artifacts, Some(&scan.calibration_id)).await?;
    // An index out of range of the type gets the same answer as one out of range of this scan.
    let frame = usize::try_from(sequence).unwrap_or(usize::MAX);
    let (frame, captured_at_ns) = match stored_frame(&*app.artifacts, &scan, frame).await? {
        Ok(found) => found,
        Err(n_frames) => {
            let detail = format!("the scan has {n_frames} frames, no frame {sequence}");
            return Err(Problem::new(ProblemKind::NotFound, detail).remedy("frames are counted from 0"));
        }
    };
    let made = blocking(move || {
        let calibration = document.calibration();
        let triangulator = Triangulator::new(calibration.clone());
        let profile = label_frame(&frame.centrelines, &triangulator, calibration.depth_range_mm);
        ProfileDto::new(sequence, frame.position, captured_at_ns, &calibration.id, &profile)
    });
    Ok(Json(made.await?))
}
