//! The camera's own features by name, for engineers.

use axum::Json;
use axum::extract::State;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use app::{App, use_cases};

use crate::Http;
use crate::problem::Problem;
use crate::rest::control::By;
use crate::rest::conversions::check_count;
use crate::rest::extract::ApiJson;
use crate::wire::hardware::features::{CameraFeatureDto, CameraFeaturesDto, ChangeFeaturesDto};

/// Most features of one request.
const MOST_FEATURES: usize = 64;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new().routes(routes!(get_camera_features, change_camera_features))
}

/// The camera's own features by name, and how its link does. 404 if the camera has none beyond its settings.
#[utoipa::path(
    get, path = "/devices/camera/features", tag = "devices", responses((status = 200, body = CameraFeaturesDto))
)]
async fn get_camera_features(State(app): State<App>) -> Result<Json<CameraFeaturesDto>, Problem> {
    let (link, features) = use_cases::camera_features(&app).await?;
    let features = features.into_iter().map(CameraFeatureDto::from).collect();
    Ok(Json(CameraFeaturesDto { link: link.into(), features }))
}

/// Sets features of the camera by name; answers with what it says then. Kept until the service ends.
#[utoipa::path(
    patch, path = "/devices/camera/features", tag = "devices", request_body = ChangeFeaturesDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = Vec<CameraFeatureDto>))
)]
async fn change_camera_features(
    State(app): State<App>,
    By(by): By,
    body: ApiJson<ChangeFeaturesDto>,
) -> Result<Json<Vec<CameraFeatureDto>>, Problem> {
    let wanted = body.value.features;
    check_count(wanted.len(), 1..=MOST_FEATURES, "/features")?;
    let wanted = wanted.into_iter().map(|feature| (feature.name, feature.value)).collect();
    let set = use_cases::set_camera_features(&app, &by, wanted).await?;
    Ok(Json(set.into_iter().map(CameraFeatureDto::from).collect()))
}
