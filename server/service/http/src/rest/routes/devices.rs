//! Camera, stage and laser: settings and single commands.

use crate::Http;
use app::events::{CameraConfigured, Event, LaserSwitched, Motion, event};
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use axum::{Extension, Json};
use devices::CameraRequest;
use station::{Manual, SharedFrame};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use vision::Pixels;

use crate::edge::Peer;
use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{Reply, bytes};
use crate::rest::control::{act, admit, authorize};
use crate::rest::conversions::{blocking, check_laser_power};
use crate::rest::etag::{Versioned, check};
use crate::rest::extract::ApiJson;
use crate::rest::idempotency::at_most_once;
use crate::wire::devices::{
    CameraDto, CameraSettingsDto, ChangeCameraDto, JogDto, LaserDto, MotionDto, MoveDto, SetLaserDto, StageDto,
};
use app::App;
use app::camera::auto_exposure::auto_exposure;
use app::camera::memory;
use app::control::Ask;
use app::hash_hex;

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

/// The camera.
#[utoipa::path(get, path = "/devices/camera", tag = "devices", responses((status = 200, body = CameraDto)))]
async fn get_camera(State(app): State<App>) -> Json<CameraDto> {
    Json((&*app.station.status()).into())
}

fn settings(app: &App) -> (String, CameraSettingsDto) {
    let settings = CameraSettingsDto::from(&app.station.status().camera_settings);
    let text = serde_json::to_vec(&settings).unwrap_or_default();
    (hash_hex(&text)[..16].to_owned(), settings)
}

/// How the camera is set; the `ETag` is needed to change it.
#[utoipa::path(
    get, path = "/devices/camera/settings", tag = "devices",
    responses((status = 200, body = CameraSettingsDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn get_camera_settings(State(app): State<App>) -> Versioned<Json<CameraSettingsDto>> {
    let (version, settings) = settings(&app);
    Versioned(version, Json(settings))
}

/// Sets the camera; answers with what it accepted.
#[utoipa::path(
    patch, path = "/devices/camera/settings", tag = "devices", request_body = ChangeCameraDto,
    params(
        ("Sheaf-Control" = String, Header, description = "Id of the control lease"),
        ("If-Match" = String, Header, description = "ETag of the settings that are changed")
    ),
    responses((status = 200, body = CameraSettingsDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn change_camera_settings(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    headers: HeaderMap,
    body: ApiJson<ChangeCameraDto>,
) -> Result<Versioned<Json<CameraSettingsDto>>, Problem> {
    authorize(&app.control, &headers)?;
    check(&headers, &settings(&app).0)?;
    let wanted = CameraRequest::from(body.value);
    app.station.manual(Manual::Configure(wanted)).await?;
    configured(&app, peer, &headers, &wanted).await
}

/// Sets the exposure so that the lines are bright and not flattened; needs a live view with light.
#[utoipa::path(
    post, path = "/devices/camera/auto-exposure", tag = "devices",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = CameraSettingsDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn auto_expose_camera(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    headers: HeaderMap,
) -> Result<Versioned<Json<CameraSettingsDto>>, Problem> {
    admit(&app, &headers, Ask::Command)?;
    auto_exposure(&app, || admit(&app, &headers, Ask::Command).map(drop)).await?;
    let exposure_us = app.station.status().camera_settings.exposure_us;
    let wanted = CameraRequest { exposure_us: Some(exposure_us), ..CameraRequest::default() };
    configured(&app, peer, &headers, &wanted).await
}

/// Keeps and tells how a person set the camera.
async fn configured(
    app: &App,
    peer: Option<Extension<Peer>>,
    headers: &HeaderMap,
    wanted: &CameraRequest,
) -> Result<Versioned<Json<CameraSettingsDto>>, Problem> {
    let (version, settings) = settings(app);
    memory::remember(&app.ledger, wanted, &app.station.status().camera_settings).await?;
    let kept = memory::KeptSettings::all(&app.station.status().camera_settings);
    let body = CameraConfigured { act: act(app, headers, peer.as_ref()), settings: kept };
    app.ledger.commit(vec![event("camera", Event::CameraConfigured(body))]).await?;
    Ok(Versioned(version, Json(settings)))
}

/// One picture as the camera is set now.
#[utoipa::path(
    get, path = "/devices/camera/snapshot.jpg", tag = "devices",
    responses((status = 200, body = Vec<u8>, content_type = "image/jpeg"))
)]
async fn get_snapshot(State(app): State<App>) -> Result<Response, Problem> {
    let frame = app.station.snapshot().await?;
    let jpeg = blocking(move || jpeg(&frame)).await??;
    Ok(bytes("image/jpeg", None, jpeg))
}

/// Good enough to judge a picture by; a third of the bytes of the best.
const JPEG_QUALITY: u8 = 85;

fn jpeg(frame: &SharedFrame) -> Result<Vec<u8>, Problem> {
    let image = &frame.image;
    let eight: std::borrow::Cow<'_, [u8]> = match image.pixels() {
        Pixels::Eight(pixels) => pixels.as_slice().into(),
        Pixels::Sixteen(pixels) => pixels.iter().map(|&grey| (grey >> 8) as u8).collect::<Vec<_>>().into(),
    };
    let side = |px: usize| {
        u16::try_from(px).map_err(|_| Problem::new(ProblemKind::Impossible, "the picture is too large for JPEG"))
    };
    let mut bytes = Vec::new();
    jpeg_encoder::Encoder::new(&mut bytes, JPEG_QUALITY)
        .encode(&eight, side(image.width())?, side(image.height())?, jpeg_encoder::ColorType::Luma)
        .map_err(|cause| {
            Problem::new(ProblemKind::Internal, "the picture cannot be packed").because(cause.to_string())
        })?;
    Ok(bytes)
}

/// The stage.
#[utoipa::path(get, path = "/devices/stage", tag = "devices", responses((status = 200, body = StageDto)))]
async fn get_stage(State(app): State<App>) -> Json<StageDto> {
    Json((&*app.station.status()).into())
}

async fn motion(
    app: &App,
    headers: &HeaderMap,
    peer: Option<Extension<Peer>>,
    command: Manual,
) -> Result<Reply, Problem> {
    admit(app, headers, Ask::Command)?;
    let (told, jog) = (motion_event(&command), matches!(command, Manual::Jog { .. }));
    let accepted = app.station.manual(command).await?;
    // A jog is repeated many times a second: its beginning is what happened.
    if accepted.is_some() || !jog {
        let (target_mm, speed_mm_s) = (accepted.map(|to| to.target_mm), accepted.map(|to| to.speed_mm_s));
        let body = Motion { act: act(app, headers, peer.as_ref()), target_mm, speed_mm_s };
        app.ledger.commit(vec![event("stage", told(body))]).await?;
    }
    let (target_mm, speed_mm_s) = (accepted.map(|to| to.target_mm), accepted.map(|to| to.speed_mm_s));
    Ok(Reply::done(None, &MotionDto { target_mm, speed_mm_s }))
}

fn motion_event(command: &Manual) -> fn(Motion) -> Event {
    match command {
        Manual::Home => Event::StageHomed,
        Manual::Jog { .. } => Event::StageJogged,
        _ => Event::StageMoved,
    }
}

/// Looks for the stage's zero; goes on after the answer.
#[utoipa::path(
    post, path = "/devices/stage/home", tag = "devices",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = MotionDto))
)]
async fn home_stage(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    headers: HeaderMap,
) -> Result<Reply, Problem> {
    let home = motion(&app, &headers, peer, Manual::Home);
    at_most_once(&app, &headers, "POST devices/stage/home", &hash_hex(&[]), home).await
}

/// Moves the stage; goes on after the answer.
#[utoipa::path(
    post, path = "/devices/stage/move", tag = "devices", request_body = MoveDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = MotionDto))
)]
async fn move_stage(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    headers: HeaderMap,
    body: ApiJson<MoveDto>,
) -> Result<Reply, Problem> {
    let MoveDto { target_mm, speed_mm_s } = body.value;
    let go = motion(&app, &headers, peer, Manual::Move { target_mm, speed_mm_s });
    at_most_once(&app, &headers, "POST devices/stage/move", &body.sha256, go).await
}

/// Moves the stage while this is repeated; it stops 300 ms after the last time.
#[utoipa::path(
    post, path = "/devices/stage/jog", tag = "devices", request_body = JogDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = MotionDto))
)]
async fn jog_stage(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    headers: HeaderMap,
    body: ApiJson<JogDto>,
) -> Result<Reply, Problem> {
    motion(&app, &headers, peer, Manual::Jog { velocity_mm_s: body.value.velocity_mm_s }).await
}

/// The laser.
#[utoipa::path(get, path = "/devices/laser", tag = "devices", responses((status = 200, body = LaserDto)))]
async fn get_laser(State(app): State<App>) -> Json<LaserDto> {
    Json((&*app.station.status()).into())
}

/// Shines with a share of full power while frames arrive; 0 goes dark.
#[utoipa::path(
    put, path = "/devices/laser", tag = "devices", request_body = SetLaserDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = LaserDto))
)]
async fn set_laser(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    headers: HeaderMap,
    body: ApiJson<SetLaserDto>,
) -> Result<Json<LaserDto>, Problem> {
    let power = body.value.power;
    check_laser_power(power, "/power")?;
    // To turn it off is refused to nobody in control, whatever the state.
    if power > 0.0 {
        admit(&app, &headers, Ask::Command)?;
    } else {
        authorize(&app.control, &headers)?;
    }
    app.station.manual(Manual::Laser { power }).await?;
    let body = LaserSwitched { act: act(&app, &headers, peer.as_ref()), power };
    app.ledger.commit(vec![event("laser", Event::LaserSwitched(body))]).await?;
    Ok(Json((&*app.station.status()).into()))
}
