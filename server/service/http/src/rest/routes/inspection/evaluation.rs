//! Plans tried on a scan, without storing anything: for teaching recipes.

use axum::extract::State;
use axum::response::Response;
use axum::{Extension, Json};
use serde_json::json;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::Http;
use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::bytes;
use crate::rest::around::heavy::Place;
use crate::rest::extract::{ApiJson, ApiPath};
use crate::wire::inspection::evaluation::{DeviationsRequestDto, EvaluatePlanDto, EvaluationDto};
use crate::wire::measurement::measurements::{FeaturesFoundDto, FindFeaturesDto};
use app::App;
use app::measurements::MeasureInput;
use app::use_cases;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(evaluate_plan))
        .routes(routes!(get_deviations))
        .routes(routes!(find_features))
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

/// Returns the deviations of the points of a scan from a CAD model, for a map: for each point five little-endian 32-bit floats:
/// x, y, z in the frame of the scan, the deviation (positive outside the surface, NaN where there is no surface to compare
/// with) and its standard uncertainty, all in mm. Takes some seconds; a request whose client goes away is cancelled.
#[utoipa::path(
    post, path = "/scans/{id}/deviations", tag = "inspections", params(("id" = String, Path)),
    request_body = DeviationsRequestDto,
    responses((status = 200, content((Vec<u8> = "application/octet-stream"))))
)]
async fn get_deviations(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    Extension(place): Extension<Place>,
    body: ApiJson<DeviationsRequestDto>,
) -> Result<Response, Problem> {
    let DeviationsRequestDto { plan, characteristic, limit } = body.value;
    let limit = limit.unwrap_or(DEVIATIONS_DEFAULT);
    if !(1..=DEVIATIONS_MAX).contains(&limit) {
        let detail = format!("{limit} points cannot be returned");
        return Err(Problem::new(ProblemKind::Impossible, detail)
            .at("/limit")
            .remedy(format!("give a number from 1 to {DEVIATIONS_MAX}")));
    }
    let rows = use_cases::deviations(&app, &id, plan.0, &characteristic, limit as usize, place).await?;
    let floats = rows.into_iter().flatten().flat_map(f32::to_le_bytes);
    Ok(bytes("application/octet-stream", None, floats.collect::<Vec<u8>>()))
}

/// Points of a map by default: more cannot be distinguished on a screen.
const DEVIATIONS_DEFAULT: u32 = 300_000;

/// Most points of a map: 100 MB.
const DEVIATIONS_MAX: u32 = 5_000_000;

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
