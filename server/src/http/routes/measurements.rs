//! Measurements on a scan.

use axum::Json;
use axum::extract::State;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::app::App;
use crate::http::dto::measurements::MeasurementDto;
use crate::http::extract::{ApiPath, ApiQuery};
use crate::http::paging::{ListDto, PageQuery};
use crate::problem::Problem;

/// The routes.
pub fn routes() -> OpenApiRouter<App> {
    OpenApiRouter::new().routes(routes!(list_measurements)).routes(routes!(get_measurement))
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
