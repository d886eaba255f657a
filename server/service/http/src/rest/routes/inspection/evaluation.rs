//! Plans tried on a scan, without storing anything: for teaching recipes.

use axum::extract::State;
use axum::{Extension, Json};
use serde_json::json;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::Http;
use crate::problem::Problem;
use crate::rest::around::heavy::Place;
use crate::rest::extract::{ApiJson, ApiPath};
use crate::wire::inspection::evaluation::{EvaluatePlanDto, EvaluationDto};
use crate::wire::measurement::measurements::{FeaturesFoundDto, FindFeaturesDto};
use app::App;
use app::measurements::MeasureInput;
use app::use_cases;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new().routes(routes!(evaluate_plan)).routes(routes!(find_features))
}

/// Evaluates a plan on a scan and returns what an inspection with it would say: values, uncertainties, verdicts. Nothing is
/// stored. Responds when done, which can take some seconds; a request whose client goes away is cancelled.
#[utoipa::path(
    post, path = "/scans/{id}/evaluate", tag = "inspections", params(("id" = String, Path)),
    request_body = EvaluatePlanDto,
    responses((status = 200, body = EvaluationDto))
)]
async fn evaluate_plan(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    Extension(place): Extension<Place>,
    body: ApiJson<EvaluatePlanDto>,
) -> Result<Json<EvaluationDto>, Problem> {
    Ok(Json(use_cases::evaluate_plan(&app, &id, body.value.plan.0, place).await?.try_into()?))
}

/// Finds the features that a tool measures on a scan: the two planes of a step, the sphere. For plans, which search each
/// feature in a region of its own. Nothing is stored; a request whose client goes away is cancelled.
#[utoipa::path(
    post, path = "/scans/{id}/find-features", tag = "inspections", params(("id" = String, Path)),
    request_body = FindFeaturesDto,
    responses((status = 200, body = FeaturesFoundDto))
)]
async fn find_features(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    Extension(place): Extension<Place>,
    body: ApiJson<FindFeaturesDto>,
) -> Result<Json<FeaturesFoundDto>, Problem> {
    let features = use_cases::find_features(&app, &id, MeasureInput::from(body.value), place).await?;
    Ok(Json(FeaturesFoundDto::try_from((id, json!(features)))?))
}
