//! Scans: start, read, download, recompute, delete.

use crate::Http;
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::Response;
use metrology::PartVerdict;
use store::{ScanFilter, ScanState};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{Reply, artifact, bytes};
use crate::rest::control::By;
use crate::rest::conversions::{accept_job, blocking, label};
use crate::rest::extract::{ApiJson, ApiPath, ApiQuery};
use crate::wire::job::jobs::JobDto;
use crate::wire::measurement::measurements::VerdictDto;
use crate::wire::paging::{ListDto, encoded, page, path_with};
use crate::wire::scan::scan_runs::{ScanPlanDto, ScanPurposeDto};
use crate::wire::scan::scans::{
    CloudQuery, MeshQuery, PointsQuery, RecomputeDto, ScanDto, ScanStateDto, ScansQuery, StartExportDto,
    StartVerificationDto,
};
use crate::wire::scan::settings::StartScanDto;
use app::App;
use app::calibrations::stored::stored_document;
use app::jobs::export::{ExportFormat, bytes_to_artifact};
use app::jobs::plan::{Pace, plan};
use app::jobs::{JobInput, RecomputeInput, ScanInput};
use app::measurements::ScanPurpose;
use app::measurements::parts::{PartFilter, part, parts};
use app::points_page::points_page;
use app::use_cases;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_scans, start_scan))
        .routes(routes!(start_verification))
        .routes(routes!(get_scan, delete_scan))
        .routes(routes!(plan_scan))
        .routes(routes!(get_cloud))
        .routes(routes!(get_mesh))
        .routes(routes!(get_points))
        .routes(routes!(recompute_scan))
        .routes(routes!(export_scan))
        .routes(routes!(get_export))
}

/// Lists scans, newest first.
#[utoipa::path(
    get, path = "/scans", tag = "scans", params(ScansQuery),
    responses((status = 200, body = ListDto<ScanDto>))
)]
async fn list_scans(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<ScansQuery>,
) -> Result<Json<ListDto<ScanDto>>, Problem> {
    let page = page(query.before, query.limit)?;
    let state = query.state.map(ScanStateDto::code);
    let purpose = query.purpose.map(ScanPurposeDto::code);
    let name = query.name.as_deref().map(encoded);
    let [from_ms, to_ms] = [query.from_ms, query.to_ms].map(|ms| ms.map(|ms| ms.to_string()));
    let [judged, measured] = [query.judged, query.measured].map(|flag| flag.map(|flag| flag.to_string()));
    let asked = [
        ("state", state),
        ("calibration_id", query.calibration_id.as_deref()),
        ("name", name.as_deref()),
        ("from_ms", from_ms.as_deref()),
        ("to_ms", to_ms.as_deref()),
        ("verdict", query.verdict.map(VerdictDto::code)),
        ("judged", judged.as_deref()),
        ("measured", measured.as_deref()),
        ("purpose", purpose),
    ];
    let path = path_with("/api/v1/scans", &asked);
    let filter = PartFilter {
        scan: ScanFilter {
            state: query.state.map(ScanState::from),
            calibration_id: query.calibration_id,
            name: query.name,
            from_ms: query.from_ms,
            to_ms: query.to_ms,
        },
        purpose: query.purpose.map(ScanPurpose::from),
        verdict: query.verdict.map(PartVerdict::from),
        judged: query.judged,
        measured: query.measured,
    };
    let listed = parts(&app.catalogue, &filter, &page).await?;
    Ok(Json(ListDto::whole_of(&path, &page, listed, ScanDto::try_from)))
}

/// Starts a scan job, from the station or from a capture.
#[utoipa::path(
    post, path = "/scans", tag = "scans", request_body = StartScanDto,
    responses((status = 202, body = JobDto, headers(("Location" = String, description = "Address of the job"))))
)]
async fn start_scan(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<StartScanDto>,
) -> Result<Reply, Problem> {
    if let Some(name) = &body.value.name {
        label(name, "/name")?;
    }
    for (idx, measure) in body.value.measure.iter().enumerate() {
        if let Some(name) = &measure.name {
            label(name, &format!("/measure/{idx}/name"))?;
        }
    }
    accept_job(&app, &by, &headers, "POST scans", &body.sha256, JobInput::Scan(body.value.into())).await
}

/// Plans a scan on the station before anything moves: rows, duration, point density, σ, depth range, disk space.
#[utoipa::path(
    post, path = "/scans/plan", tag = "scans", request_body = StartScanDto,
    responses((status = 200, body = ScanPlanDto))
)]
async fn plan_scan(State(app): State<App>, body: ApiJson<StartScanDto>) -> Result<Json<ScanPlanDto>, Problem> {
    let input = ScanInput::from(body.value);
    let document = stored_document(&app.catalogue, &*app.artifacts, input.calibration_id.as_deref()).await?;
    let status = app.station.status();
    let pace = Pace::learned(&app.catalogue, input.settings.mode()).await;
    let planned = blocking(move || plan(&input, &document.calibration(), &status, &pace)).await??;
    Ok(Json(planned.into()))
}

/// Starts a verification job: scans a reference part and compares it with its nominal value.
#[utoipa::path(
    post, path = "/verifications", tag = "scans", request_body = StartVerificationDto,
    responses((status = 202, body = JobDto, headers(("Location" = String, description = "Address of the job"))))
)]
async fn start_verification(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<StartVerificationDto>,
) -> Result<Reply, Problem> {
    let input = JobInput::Verification(body.value.into());
    accept_job(&app, &by, &headers, "POST verifications", &body.sha256, input).await
}

/// Returns a scan.
#[utoipa::path(
    get, path = "/scans/{id}", tag = "scans", params(("id" = String, Path)),
    responses((status = 200, body = ScanDto))
)]
async fn get_scan(State(app): State<App>, ApiPath(id): ApiPath<String>) -> Result<Json<ScanDto>, Problem> {
    let scan = app.catalogue.read().scan(&id).await?;
    let (part, _) = part(&app.catalogue, scan).await?;
    Ok(Json(part.try_into()?))
}

/// Deletes a scan and its measurements.
#[utoipa::path(
    delete, path = "/scans/{id}", tag = "scans", params(("id" = String, Path)),
    responses((status = 204, description = "Deleted"))
)]
async fn delete_scan(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
) -> Result<StatusCode, Problem> {
    use_cases::delete_scan(&app, &by, id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Downloads the point cloud of a scan.
#[utoipa::path(
    get, path = "/scans/{id}/cloud", tag = "scans", params(("id" = String, Path), CloudQuery),
    responses((status = 200, content((Vec<u8> = "application/octet-stream"), (String = "text/csv"), (Vec<u8> = "model/e57"))))
)]
async fn get_cloud(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<CloudQuery>,
) -> Result<Response, Problem> {
    let format = query.format.unwrap_or_default();
    download(&app, &id, "cloud", format.code()).await
}

/// Downloads the mesh of a scan.
#[utoipa::path(
    get, path = "/scans/{id}/mesh", tag = "scans", params(("id" = String, Path), MeshQuery),
    responses((status = 200, content(
        (Vec<u8> = "model/stl"), (Vec<u8> = "model/gltf-binary"), (Vec<u8> = "application/octet-stream")
    )))
)]
async fn get_mesh(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<MeshQuery>,
) -> Result<Response, Problem> {
    let format = query.format.unwrap_or_default();
    download(&app, &id, "mesh", format.code()).await
}

async fn download(app: &App, id: &str, what: &str, format: &str) -> Result<Response, Problem> {
    let scan = app.catalogue.read().scan(id).await?;
    let format = ExportFormat::parse(what, format)?;
    let made = bytes_to_artifact(&app.artifacts, &scan, format).await?;
    artifact(
        app,
        &made,
        &format!("the {what} of scan {id}"),
        format.media_type(),
        Some(&format!("{}{}.{}", scan.name, if what == "mesh" { " mesh" } else { "" }, format.extension())),
    )
    .await
}

/// Returns display points of a scan in blocks, as in the live stream: for viewers that missed some, also while it runs.
#[utoipa::path(
    get, path = "/scans/{id}/points", tag = "scans", params(("id" = String, Path), PointsQuery),
    responses((
        status = 200, body = Vec<u8>, content_type = "application/octet-stream",
        headers(
            ("Sheaf-Next-Block" = u32, description = "First block of the next request"),
            ("Sheaf-Complete" = bool, description = "Whether these are the last blocks of the scan")
        )
    ))
)]
async fn get_points(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<PointsQuery>,
) -> Result<Response, Problem> {
    let from = query.from_block.unwrap_or(0);
    let page = points_page(&app.live, &app.catalogue, &app.artifacts, &id, from).await?;
    let mut response = bytes("application/octet-stream", None, page.bytes);
    let complete = if page.complete { "true" } else { "false" };
    response.headers_mut().insert("sheaf-next-block", HeaderValue::from(page.next_block));
    response.headers_mut().insert("sheaf-complete", HeaderValue::from_static(complete));
    Ok(response)
}

/// Starts a job that recomputes a scan from its peaks with another calibration; the original scan is kept.
#[utoipa::path(
    post, path = "/scans/{id}/recompute", tag = "scans", params(("id" = String, Path)),
    request_body = RecomputeDto,
    responses((status = 202, body = JobDto, headers(("Location" = String, description = "Address of the job"))))
)]
async fn recompute_scan(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<RecomputeDto>,
) -> Result<Reply, Problem> {
    app.catalogue.read().scan(&id).await?;
    let route = format!("POST scans/{id}/recompute");
    let calibration_id = body.value.calibration_id;
    let input = JobInput::Recomputation(RecomputeInput { scan_id: id, calibration_id });
    accept_job(&app, &by, &headers, &route, &body.sha256, input).await
}

/// Starts a job that writes a scan in another format.
#[utoipa::path(
    post, path = "/scans/{id}/exports", tag = "scans", params(("id" = String, Path)),
    request_body = StartExportDto,
    responses((status = 202, body = JobDto, headers(("Location" = String, description = "Address of the job"))))
)]
async fn export_scan(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<StartExportDto>,
) -> Result<Reply, Problem> {
    app.catalogue.read().scan(&id).await?;
    let route = format!("POST scans/{id}/exports");
    let input = JobInput::Export(body.value.input(id));
    accept_job(&app, &by, &headers, &route, &body.sha256, input).await
}

/// Downloads an exported file by name: `cloud.csv`, `mesh.stl`.
#[utoipa::path(
    get, path = "/scans/{id}/exports/{file}", tag = "scans", params(("id" = String, Path), ("file" = String, Path)),
    responses((status = 200, content(
        (Vec<u8> = "application/octet-stream"), (String = "text/csv"), (Vec<u8> = "model/e57"),
        (Vec<u8> = "model/stl"), (Vec<u8> = "model/gltf-binary")
    )))
)]
async fn get_export(
    State(app): State<App>,
    ApiPath((id, file)): ApiPath<(String, String)>,
) -> Result<Response, Problem> {
    let (what, format) = file.split_once('.').ok_or_else(|| {
        Problem::new(ProblemKind::NotFound, format!("export \"{file}\" does not exist"))
            .remedy("exports have names such as cloud.csv or mesh.stl")
    })?;
    download(&app, &id, what, format).await
}
