//! The camera's dark frame.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use app::camera::dark_frame::no_dark_frame;
use app::{App, use_cases};

use crate::Http;
use crate::problem::{Problem, ProblemKind};
use crate::rest::control::By;
use crate::rest::extract::ApiJson;
use crate::wire::hardware::dark_frame::{DarkFrameDto, TakeDarkFrameDto};

/// Frames averaged unless the request says otherwise: the noise of the mean is a sixth of that of a frame.
const N_FRAMES: usize = 32;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new().routes(routes!(get_dark_frame, take_dark_frame, remove_dark_frame))
}

/// Returns the camera's dark frame and how it is used now. 404 if none was taken.
#[utoipa::path(
    get, path = "/devices/camera/dark-frame", tag = "devices", responses((status = 200, body = DarkFrameDto))
)]
async fn get_dark_frame(State(app): State<App>) -> Result<Json<DarkFrameDto>, Problem> {
    let kept = app.dark_frames.get().await.ok_or_else(no_dark_frame)?;
    Ok(Json(DarkFrameDto::new(&kept, app.station.status().dark_frame_use)))
}

/// Takes a dark frame at the current camera settings: cover the lens first. The laser is off meanwhile. From then on all
/// frames of this camera are corrected by it, also after a restart.
#[utoipa::path(
    post, path = "/devices/camera/dark-frame", tag = "devices", request_body = TakeDarkFrameDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = DarkFrameDto))
)]
async fn take_dark_frame(
    State(app): State<App>,
    By(by): By,
    body: ApiJson<TakeDarkFrameDto>,
) -> Result<Json<DarkFrameDto>, Problem> {
    let n_frames = body.value.n_frames.unwrap_or(N_FRAMES);
    if !(8..=256).contains(&n_frames) {
        return Err(Problem::new(ProblemKind::Impossible, format!("{n_frames} frames cannot be averaged"))
            .at("/n_frames")
            .remedy("give 8 to 256"));
    }
    let kept = use_cases::take_dark_frame(&app, &by, n_frames).await?;
    let status = app.station.status();
    let used = kept.dark.use_for(&status.camera.identity, &status.camera_settings);
    Ok(Json(DarkFrameDto::new(&kept, used)))
}

/// Removes the dark frame: frames are no longer corrected.
#[utoipa::path(
    delete, path = "/devices/camera/dark-frame", tag = "devices",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 204, description = "removed"))
)]
async fn remove_dark_frame(State(app): State<App>, By(by): By) -> Result<StatusCode, Problem> {
    use_cases::remove_dark_frame(&app, &by).await?;
    Ok(StatusCode::NO_CONTENT)
}
