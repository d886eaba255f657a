//! Measurements on a scan.

use crate::Http;
use axum::Json;
use axum::extract::State;
use axum::http::HeaderMap;
use metrology::{PartVerdict, Tool};
use store::{MeasurementFilter, MeasurementRecord};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::Problem;
use crate::rest::answers::Reply;
use crate::rest::control::By;
use crate::rest::conversions::label;
use crate::rest::extract::{ApiJson, ApiPath, ApiQuery};
use crate::rest::idempotency::{Begun, begin};
use crate::wire::measurement::measurements::{MeasureDto, MeasurementDto, MeasurementsQuery, VerdictDto};
use crate::wire::paging::{ListDto, PageQuery, page, path_with};
use crate::wire::scan::scans::scan_href;
use app::App;
use app::measurements::MeasureInput;
use app::use_cases;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_measurements))
        .routes(routes!(list_scan_measurements, create_measurement))
        .routes(routes!(get_measurement))
}

/// Lists measurements on all scans, newest first.
#[utoipa::path(
    get, path = "/measurements", tag = "measurements", params(MeasurementsQuery),
    responses((status = 200, body = ListDto<MeasurementDto>))
)]
async fn list_measurements(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<MeasurementsQuery>,
) -> Result<Json<ListDto<MeasurementDto>>, Problem> {
    let page = page(query.before, query.limit)?;
    let tool = query.tool.map(|tool| Tool::from(tool).name());
    let verdict = query.verdict.map(VerdictDto::code);
    let path = path_with("/api/v1/measurements", &[("tool", tool), ("verdict", verdict)]);
    let filter =
        MeasurementFilter { scan_id: None, tool: tool.map(str::to_owned), verdicts: codes_of(query.verdict) };
    let listed = app.catalogue.read().measurements(&filter, &page).await?;
    Ok(Json(ListDto::whole_of(&path, &page, listed, MeasurementDto::try_from)))
}

/// A verdict's code, and the one in records of earlier versions.
fn codes_of(verdict: Option<VerdictDto>) -> Vec<String> {
    let Some(verdict) = verdict else { return Vec::new() };
    let known = ["pass", "fail", verdict.code()];
    let same = known.into_iter().filter(|word| PartVerdict::from_name(word) == Some(verdict.into()));
    same.map(str::to_owned).collect()
}

/// Lists the measurements of a scan, newest first.
#[utoipa::path(
    get, path = "/scans/{id}/measurements", tag = "measurements", params(("id" = String, Path), PageQuery),
    responses((status = 200, body = ListDto<MeasurementDto>))
)]
async fn list_scan_measurements(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<PageQuery>,
) -> Result<Json<ListDto<MeasurementDto>>, Problem> {
    let page = query.page()?;
    app.catalogue.read().scan(&id).await?;
    let path = format!("/api/v1/scans/{id}/measurements");
    let filter = MeasurementFilter { scan_id: Some(id), ..MeasurementFilter::default() };
    let listed = app.catalogue.read().measurements(&filter, &page).await?;
    Ok(Json(ListDto::whole_of(&path, &page, listed, MeasurementDto::try_from)))
}

/// Returns a measurement.
#[utoipa::path(
    get, path = "/scans/{id}/measurements/{measurement_id}", tag = "measurements",
    params(("id" = String, Path), ("measurement_id" = String, Path)),
    responses((status = 200, body = MeasurementDto))
)]
async fn get_measurement(
    State(app): State<App>,
    ApiPath((id, measurement_id)): ApiPath<(String, String)>,
) -> Result<Json<MeasurementDto>, Problem> {
    let record = app.catalogue.read().measurement(&measurement_id).await?;
    if record.scan_id != id {
        return Err(store::StoreError::NotFound { kind: "measurement", id: measurement_id }.into());
    }
    Ok(Json(record.try_into()?))
}

/// Measures on a scan; responds when done, which can take some seconds. A characteristic with a tolerance that cannot be
/// measured is stored with the verdict `invalid`.
#[utoipa::path(
    post, path = "/scans/{id}/measurements", tag = "measurements", params(("id" = String, Path)),
    request_body = MeasureDto,
    responses((status = 201, body = MeasurementDto))
)]
async fn create_measurement(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<MeasureDto>,
) -> Result<Reply, Problem> {
    let route = format!("POST scans/{id}/measurements");
    let once = match begin(&app, &headers, &route, &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    if let Some(name) = &body.value.name {
        label(name, "/name")?;
    }
    let made = |record: &MeasurementRecord| {
        let href = format!("{}/measurements/{}", scan_href(&id), record.id);
        Ok::<_, Problem>(Reply::created(href, &MeasurementDto::try_from(record.clone())?))
    };
    let input = MeasureInput::from(body.value);
    let and = |record: &MeasurementRecord| Ok::<_, Problem>(once.changes(&made(record)?));
    made(&use_cases::measure(&app, &by, &id, input, and).await?)
}
