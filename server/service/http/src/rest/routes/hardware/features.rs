//! Camera features by name (GenICam), for engineers.

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

/// Maximum number of features per request.
const MOST_FEATURES: usize = 64;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new().routes(routes!(get_camera_features, change_camera_features))
}

/// Returns the camera's features by name and the state of its link. 404 if the camera has no features of its own.
#[utoipa::path(
    get, path = "/devices/camera/features", tag = "devices", responses((status = 200, body = CameraFeaturesDto))
)]
async fn get_camera_features(State(app): State<App>) -> Result<Json<CameraFeaturesDto>, Problem> {
    let (link, features) = use_cases::camera_features(&app).await?;
    let features = features.into_iter().map(CameraFeatureDto::from).collect();
    Ok(Json(CameraFeaturesDto { link: link.into(), features }))
}

/// Sets camera features by name; returns them as read back. They apply until the service restarts.
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
