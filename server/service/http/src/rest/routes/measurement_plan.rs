//! The measurement plan: what *Start* scans and measures.

use crate::Http;
use axum::Json;
use axum::extract::State;
use axum::http::HeaderMap;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::Problem;
use crate::rest::control::By;
use crate::rest::etag::{Versioned, check};
use crate::rest::extract::ApiJson;
use crate::wire::measurement::measurement_plan::MeasurementPlanDto;
use app::App;
use app::labels::label;
use app::measurements::plan::KeptPlan;
use app::use_cases::change_measurement_plan;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new().routes(routes!(get_measurement_plan, set_measurement_plan))
}

fn versioned(kept: KeptPlan) -> Versioned<Json<MeasurementPlanDto>> {
    Versioned(kept.version.to_string(), Json(kept.plan.into()))
}

/// Returns the measurement plan of the station; its `ETag` is needed to change it.
#[utoipa::path(
    get, path = "/measurement-plan", tag = "measurements",
    responses((status = 200, body = MeasurementPlanDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn get_measurement_plan(State(app): State<App>) -> Result<Versioned<Json<MeasurementPlanDto>>, Problem> {
    Ok(versioned(app.measurement_plans.get().await?))
}

/// Replaces the measurement plan for all users. Running scans keep the plan they were started with.
#[utoipa::path(
    put, path = "/measurement-plan", tag = "measurements", request_body = MeasurementPlanDto,
    params(("If-Match" = String, Header, description = "ETag of the current plan, or `*`")),
    responses((status = 200, body = MeasurementPlanDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn set_measurement_plan(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<MeasurementPlanDto>,
) -> Result<Versioned<Json<MeasurementPlanDto>>, Problem> {
    for (idx, measure) in body.value.measure.iter().enumerate() {
        if let Some(name) = &measure.name {
            label(name, &format!("/measure/{idx}/name"))?;
        }
    }
    let may = |version: Option<u64>| {
        check(&headers, &version.map_or_else(|| "damaged".to_owned(), |version| version.to_string()))
    };
    let kept = change_measurement_plan(&app, &by, body.value.try_into()?, may).await?;
    Ok(versioned(kept))
}
