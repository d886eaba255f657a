//! The station: state, Stop, reset, live view.

use crate::Http;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::{Extension, Json};
use station::LiveRequest;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::edge::Peer;
use crate::limits::JSON_BODY_LIMIT_BYTES;
use crate::problem::Problem;
use crate::rest::control::{By, NAMELESS, principal};
use crate::rest::conversions::check_laser_power;
use crate::rest::extract::ApiJson;
use crate::wire::hardware::control::ControlDto;
use crate::wire::hardware::station::{SetLiveDto, StationDto, StoppedDto};
use crate::wire::scan::watches::WatchHistoryDto;
use app::App;
use app::principal::Principal;
use app::use_cases::{self, reset, stop};
use app::watches::WatchHistory;

/// Longest time Stop's answer waits for a body it does not need.
const STOP_BODY_TIMEOUT: Duration = Duration::from_millis(100);

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(get_station))
        .routes(routes!(stop_station))
        .routes(routes!(reset_station))
        .routes(routes!(set_live_view))
        .routes(routes!(get_watches))
}

/// The station as last seen.
#[utoipa::path(get, path = "/station", tag = "station", responses((status = 200, body = StationDto)))]
async fn get_station(State(app): State<App>) -> Json<StationDto> {
    Json(station(&app))
}

fn station(app: &App) -> StationDto {
    let control = app.control.present(Instant::now());
    StationDto::new(&app.station.status(), control.as_ref().map(ControlDto::from))
}

/// Stops motion, turns the laser off, ends what runs and empties the station's queue.
///
/// Works for everybody at any time, needs no control, no body, no key; answers once the devices received it. It latches:
/// motion and laser stay off until a reset, over restarts too.
#[utoipa::path(post, path = "/station/stop", tag = "station", responses((status = 200, body = StoppedDto)))]
async fn stop_station(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    headers: HeaderMap,
    body: Body,
) -> Json<StoppedDto> {
    let outcome = stop(&app, &stopped_by(&app, &headers, peer.as_deref())).await;
    // Bytes that nobody reads would break the connection under the client's next request. They are awaited only now.
    let _ = tokio::time::timeout(STOP_BODY_TIMEOUT, axum::body::to_bytes(body, JSON_BODY_LIMIT_BYTES)).await;
    Json(StoppedDto::new(outcome, app.station.status().state))
}

/// Who stopped: the holder of the lease that came along or the name that did, else the address.
fn stopped_by(app: &App, headers: &HeaderMap, peer: Option<&Peer>) -> Principal {
    let by = principal(&app.control, headers, peer);
    match peer {
        Some(_) if by.actor == NAMELESS => Principal { actor: format!("{NAMELESS} {}", by.source), ..by },
        _ => by,
    }
}

/// Acknowledges faults, reaches devices again, leaves Halted. Motion and laser stay off.
#[utoipa::path(
    post, path = "/station/reset", tag = "station",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = StationDto))
)]
async fn reset_station(State(app): State<App>, By(by): By) -> Result<Json<StationDto>, Problem> {
    reset(&app, &by).await?;
    Ok(Json(station(&app)))
}

/// Starts or ends the live view.
///
/// Light needs a viewer: the laser is turned off 4 s after the last connection that is subscribed to `image` or
/// `profile` was there, and only another request turns it on again. The view itself ends after 30 s.
#[utoipa::path(
    put, path = "/station/live", tag = "station", request_body = SetLiveDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = StationDto))
)]
async fn set_live_view(
    State(app): State<App>,
    By(by): By,
    body: ApiJson<SetLiveDto>,
) -> Result<Json<StationDto>, Problem> {
    let SetLiveDto { running, laser_power } = body.value;
    check_laser_power(laser_power, "/laser_power")?;
    use_cases::set_live_view(&app, &by, LiveRequest { running, laser_power }).await?;
    Ok(Json(station(&app)))
}

/// What the watches said of the last scans: lost steps, wavelength, order powers, stage scale.
#[utoipa::path(get, path = "/station/watches", tag = "station", responses((status = 200, body = WatchHistoryDto)))]
async fn get_watches(State(app): State<App>) -> Result<Json<WatchHistoryDto>, Problem> {
    Ok(Json(WatchHistory::read(&app.ledger).await?.into()))
}
