//! Measurements on a scan.

use axum::Json;
use axum::extract::State;
use axum::http::HeaderMap;
use metrology::MeasureRequest;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::app::App;
use crate::http::answers::Reply;
use crate::http::conversions::blocking;
use crate::http::dto::measurements::{MeasureDto, MeasurementDto};
use crate::http::dto::scans::scan_href;
use crate::http::extract::{ApiJson, ApiPath, ApiQuery};
use crate::http::idempotency::{Begun, begin};
use crate::http::paging::{ListDto, PageQuery};
use crate::measurements::{changes, measurement};
use crate::problem::Problem;
use crate::stored_calibration::stored_document;
use crate::stored_scan::stored_cloud;

/// The routes.
pub fn routes() -> OpenApiRouter<App> {
    OpenApiRouter::new().routes(routes!(list_measurements, measure)).routes(routes!(get_measurement))
}

/// The measurements of a scan, newest first.
#[utoipa::path(
    get, path = "/scans/{id}/measurements", tag = "measurements", params(("id" = String, Path), PageQuery),
    responses((status = 200, body = ListDto<MeasurementDto>))
)]
async fn list_measurements(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<PageQuery>,
) -> Result<Json<ListDto<MeasurementDto>>, Problem> {
    let page = query.page()?;
    app.ledger.read().scan(&id).await?;
    let records = app.ledger.read().measurements(&id, &page).await?;
    let path = format!("/api/v1/scans/{id}/measurements");
    Ok(Json(ListDto::new(&path, &page, records, |record| record.id.clone(), MeasurementDto::from)))
}

/// A measurement.
#[utoipa::path(
    get, path = "/scans/{id}/measurements/{measurement_id}", tag = "measurements",
    params(("id" = String, Path), ("measurement_id" = String, Path)),
    responses((status = 200, body = MeasurementDto))
)]
async fn get_measurement(
    State(app): State<App>,
    ApiPath((id, measurement_id)): ApiPath<(String, String)>,
) -> Result<Json<MeasurementDto>, Problem> {
    let record = app.ledger.read().measurement(&measurement_id).await?;
    if record.scan_id != id {
        return Err(store::StoreError::NotFound { kind: "measurement", id: measurement_id }.into());
    }
    Ok(Json(record.into()))
}

/// Measures on a scan; answers when it is done, which takes up to some seconds.
#[utoipa::path(
    post, path = "/scans/{id}/measurements", tag = "measurements", params(("id" = String, Path)),
    request_body = MeasureDto,
    responses((status = 201, body = MeasurementDto))
)]
async fn measure(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    headers: HeaderMap,
    body: ApiJson<MeasureDto>,
) -> Result<Reply, Problem> {
    let route = format!("POST scans/{id}/measurements");
    let once = match begin(&app, &headers, &route, &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let scan = app.ledger.read().scan(&id).await?;
    let document = stored_document(&app.ledger, &*app.artifacts, Some(&scan.calibration_id)).await?;
    let cloud = stored_cloud(&*app.artifacts, &scan).await?;
    let request = MeasureRequest::try_from(body.value)?;
    let record = blocking(move || measurement(&scan, &cloud, &document.calibration(), &request)).await??;
    let href = format!("{}/measurements/{}", scan_href(&id), record.id);
    let mut all = changes(&record);
    let reply = Reply::created(href, &MeasurementDto::from(record));
    all.extend(once.changes(&reply));
    app.ledger.commit(all).await?;
    Ok(reply)
}
