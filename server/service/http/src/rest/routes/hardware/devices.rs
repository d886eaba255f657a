//! Camera, stage and laser: settings and commands.

use crate::Http;
use axum::Json;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use devices::{CameraRequest, StageKind};
use station::{Manual, SharedFrame};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use vision::Pixels;

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{Reply, bytes};
use crate::rest::control::By;
use crate::rest::conversions::{blocking, check_laser_power};
use crate::rest::etag::{Versioned, check};
use crate::rest::extract::ApiJson;
use crate::rest::idempotency::at_most_once;
use crate::wire::hardware::devices::stage::{in_stage_unit, required_in_stage_unit};
use crate::wire::hardware::devices::{
    CameraDto, CameraSettingsDto, ChangeCameraDto, JogDto, LaserDto, MotionDto, MoveDto, SetLaserDto, StageDto,
};
use app::App;
use app::hash_hex;
use app::principal::Principal;
use app::use_cases;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(get_camera))
        .routes(routes!(get_camera_settings, change_camera_settings))
        .routes(routes!(auto_expose_camera))
        .routes(routes!(get_snapshot))
        .routes(routes!(get_stage))
        .routes(routes!(home_stage))
        .routes(routes!(move_stage))
        .routes(routes!(jog_stage))
        .routes(routes!(get_laser, set_laser))
}

/// Returns the camera: capabilities, settings, measured frame rate.
#[utoipa::path(get, path = "/devices/camera", tag = "devices", responses((status = 200, body = CameraDto)))]
async fn get_camera(State(app): State<App>) -> Json<CameraDto> {
    Json((&*app.station.status()).into())
}

fn settings(app: &App) -> (String, CameraSettingsDto) {
    let settings = CameraSettingsDto::from(&app.station.status().camera_settings);
    let text = serde_json::to_vec(&settings).unwrap_or_default();
    (hash_hex(&text)[..16].to_owned(), settings)
}

/// Returns the camera settings; their `ETag` is needed to change them.
#[utoipa::path(
    get, path = "/devices/camera/settings", tag = "devices",
    responses((status = 200, body = CameraSettingsDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn get_camera_settings(State(app): State<App>) -> Versioned<Json<CameraSettingsDto>> {
    let (version, settings) = settings(&app);
    Versioned(version, Json(settings))
}

/// Changes camera settings; returns the settings that the camera accepted.
#[utoipa::path(
    patch, path = "/devices/camera/settings", tag = "devices", request_body = ChangeCameraDto,
    params(
        ("Sheaf-Control" = String, Header, description = "Id of the control lease"),
        ("If-Match" = String, Header, description = "ETag of the current settings")
    ),
    responses((status = 200, body = CameraSettingsDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn change_camera_settings(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<ChangeCameraDto>,
) -> Result<Versioned<Json<CameraSettingsDto>>, Problem> {
    let may = || check(&headers, &settings(&app).0);
    use_cases::configure_camera(&app, &by, CameraRequest::from(body.value), may).await?;
    Ok(get_camera_settings(State(app)).await)
}

/// Adjusts the exposure so that the laser lines are bright but not saturated. Needs a live view with the laser on.
#[utoipa::path(
    post, path = "/devices/camera/auto-exposure", tag = "devices",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = CameraSettingsDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn auto_expose_camera(
    State(app): State<App>,
    By(by): By,
) -> Result<Versioned<Json<CameraSettingsDto>>, Problem> {
    use_cases::auto_expose(&app, &by).await?;
    Ok(get_camera_settings(State(app)).await)
}

/// Captures one JPEG image with the current settings.
#[utoipa::path(
    get, path = "/devices/camera/snapshot.jpg", tag = "devices",
    responses((status = 200, body = Vec<u8>, content_type = "image/jpeg"))
)]
async fn get_snapshot(State(app): State<App>) -> Result<Response, Problem> {
    let frame = app.station.snapshot().await?;
    let jpeg = blocking(move || jpeg(&frame)).await??;
    Ok(bytes("image/jpeg", None, jpeg))
}

/// JPEG quality: good enough to judge an image, a third of the size of the best.
const JPEG_QUALITY: u8 = 85;

fn jpeg(frame: &SharedFrame) -> Result<Vec<u8>, Problem> {
    let image = &frame.image;
    let eight: std::borrow::Cow<'_, [u8]> = match image.pixels() {
        Pixels::Eight(pixels) => pixels.as_slice().into(),
        Pixels::Sixteen(pixels) => pixels.iter().map(|&grey| (grey >> 8) as u8).collect::<Vec<_>>().into(),
    };
    let side = |px: usize| {
        u16::try_from(px).map_err(|_| Problem::new(ProblemKind::Impossible, "the image is too large for JPEG"))
    };
    let size_px = (side(image.width())?, side(image.height())?);
    live::jpeg::grey_jpeg(&eight, size_px, JPEG_QUALITY).map_err(|cause| {
        Problem::new(ProblemKind::Internal, "the image cannot be encoded").because(cause.to_string())
    })
}

/// Returns the stage: capabilities and position.
#[utoipa::path(get, path = "/devices/stage", tag = "devices", responses((status = 200, body = StageDto)))]
async fn get_stage(State(app): State<App>) -> Json<StageDto> {
    Json((&*app.station.status()).into())
}

async fn motion(app: &App, by: &Principal, command: Manual) -> Result<Reply, Problem> {
    let accepted = use_cases::move_stage(app, by, command).await?;
    Ok(Reply::done(None, &MotionDto::new(stage_kind(app), accepted)))
}

fn stage_kind(app: &App) -> StageKind {
    app.station.status().stage.capabilities.kind
}

/// Starts homing the stage; returns before the motion ends.
#[utoipa::path(
    post, path = "/devices/stage/home", tag = "devices",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = MotionDto))
)]
async fn home_stage(State(app): State<App>, By(by): By, headers: HeaderMap) -> Result<Reply, Problem> {
    let home = motion(&app, &by, Manual::Home);
    at_most_once(&app, &headers, "POST devices/stage/home", &hash_hex(&[]), home).await
}

/// Starts a move of the stage; returns before the motion ends.
#[utoipa::path(
    post, path = "/devices/stage/move", tag = "devices", request_body = MoveDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = MotionDto))
)]
async fn move_stage(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<MoveDto>,
) -> Result<Reply, Problem> {
    let MoveDto { target_mm, target_deg, speed_mm_s, speed_deg_s } = body.value;
    let kind = stage_kind(&app);
    let target_mm = required_in_stage_unit(kind, ("target_mm", target_mm), ("target_deg", target_deg))?;
    let speed_mm_s = in_stage_unit(kind, ("speed_mm_s", speed_mm_s), ("speed_deg_s", speed_deg_s))?;
    let go = motion(&app, &by, Manual::Move { target_mm, speed_mm_s });
    at_most_once(&app, &headers, "POST devices/stage/move", &body.sha256, go).await
}

/// Jogs the stage while the request is repeated; it stops 300 ms after the last request.
#[utoipa::path(
    post, path = "/devices/stage/jog", tag = "devices", request_body = JogDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = MotionDto))
)]
async fn jog_stage(State(app): State<App>, By(by): By, body: ApiJson<JogDto>) -> Result<Reply, Problem> {
    let JogDto { velocity_mm_s, velocity_deg_s } = body.value;
    let (linear, rotary) = (("velocity_mm_s", velocity_mm_s), ("velocity_deg_s", velocity_deg_s));
    let velocity_mm_s = required_in_stage_unit(stage_kind(&app), linear, rotary)?;
    motion(&app, &by, Manual::Jog { velocity_mm_s }).await
}

/// Returns the laser: state, power, interlock.
#[utoipa::path(get, path = "/devices/laser", tag = "devices", responses((status = 200, body = LaserDto)))]
async fn get_laser(State(app): State<App>) -> Json<LaserDto> {
    Json((&*app.station.status()).into())
}

/// Sets the laser power as a fraction of full power; 0 turns it off. The laser is on only while frames arrive.
#[utoipa::path(
    put, path = "/devices/laser", tag = "devices", request_body = SetLaserDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = LaserDto))
)]
async fn set_laser(
    State(app): State<App>,
    By(by): By,
    body: ApiJson<SetLaserDto>,
) -> Result<Json<LaserDto>, Problem> {
    let power = body.value.power;
    check_laser_power(power, "/power")?;
    use_cases::switch_laser(&app, &by, power).await?;
    Ok(Json((&*app.station.status()).into()))
}
