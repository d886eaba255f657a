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
use crate::wire::hardware::station::{SetLiveDto, StationDto, StopResultDto};
use crate::wire::scan::watches::WatchHistoryDto;
use app::App;
use app::principal::Principal;
use app::use_cases::{self, reset, stop};
use app::watches::WatchHistory;

/// Maximum time that the response to Stop waits for a body it does not need.
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

/// Returns the latest state of the station and its devices.
#[utoipa::path(get, path = "/station", tag = "station", responses((status = 200, body = StationDto)))]
async fn get_station(State(app): State<App>) -> Json<StationDto> {
    Json(station(&app))
}

fn station(app: &App) -> StationDto {
    let control = app.control.present(Instant::now());
    StationDto::new(&app.station.status(), control.as_ref().map(ControlDto::from))
}

/// Stops motion, turns the laser off, ends running jobs and clears the station's queue.
///
/// Available to everyone at any time, without control, body or key. Responds once the devices have received it. Stop
/// latches: motion and laser stay off until a reset, across restarts too.
#[utoipa::path(post, path = "/station/stop", tag = "station", responses((status = 200, body = StopResultDto)))]
async fn stop_station(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    headers: HeaderMap,
    body: Body,
) -> Json<StopResultDto> {
    let outcome = stop(&app, &stopped_by(&app, &headers, peer.as_deref())).await;
    // Unread bytes would corrupt the client's next request on this connection; they are drained only after the Stop.
    let _ = tokio::time::timeout(STOP_BODY_TIMEOUT, axum::body::to_bytes(body, JSON_BODY_LIMIT_BYTES)).await;
    Json(StopResultDto::new(outcome, app.station.status().state))
}

/// Who stopped: the lease holder, else the name in the request, else the address.
fn stopped_by(app: &App, headers: &HeaderMap, peer: Option<&Peer>) -> Principal {
    let by = principal(&app.control, headers, peer);
    match peer {
        Some(_) if by.actor == NAMELESS => Principal { actor: format!("{NAMELESS} {}", by.source), ..by },
        _ => by,
    }
}

/// Acknowledges faults, reconnects devices and leaves `Halted`. Motion and laser stay off.
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
/// The laser needs a viewer: it is turned off 4 s after the last connection subscribed to `image` or `profile` has gone,
/// and only a new request turns it on again. The live view itself ends after 30 s.
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

/// Returns the results of the watches on recent scans: lost steps, wavelength, order powers, stage scale.
#[utoipa::path(get, path = "/station/watches", tag = "station", responses((status = 200, body = WatchHistoryDto)))]
async fn get_watches(State(app): State<App>) -> Result<Json<WatchHistoryDto>, Problem> {
    Ok(Json(WatchHistory::read(&app.catalogue).await?.into()))
}
