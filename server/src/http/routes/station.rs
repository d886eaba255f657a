//! The station: state, Stop, reset, live view.

use std::net::IpAddr;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::{Extension, Json};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::app::App;
use crate::config::limits::JSON_BODY_LIMIT_BYTES;
use crate::edge::Peer;
use crate::http::conversions::check_laser_power;
use crate::http::dto::control::ControlDto;
use crate::http::dto::station::{SetLiveDto, StationDto, StoppedDto, state_names};
use crate::http::extract::ApiJson;
use crate::problem::Problem;
use crate::station::{LiveRequest, Manual};

/// Longest time Stop's answer waits for a body it does not need.
const STOP_BODY_TIMEOUT: Duration = Duration::from_millis(100);

/// The routes.
pub fn routes() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(get_station))
        .routes(routes!(stop_station))
        .routes(routes!(reset_station))
        .routes(routes!(set_live_view))
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

/// Stops motion, darkens the laser, ends what runs and what waits for the station.
///
/// Works for everybody at any time, needs no control, no body, no key; answers once the devices were told.
#[utoipa::path(post, path = "/station/stop", tag = "station", responses((status = 200, body = StoppedDto)))]
async fn stop_station(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    headers: HeaderMap,
    body: Body,
) -> Json<StoppedDto> {
    let actor = actor(&app, &headers, peer.map(|peer| peer.0.0.ip()));
    let outcome = app.station.stop(&actor).await;
    // Bytes that nobody reads would break the connection under the client's next request. They are awaited only now.
    let _ = tokio::time::timeout(STOP_BODY_TIMEOUT, axum::body::to_bytes(body, JSON_BODY_LIMIT_BYTES)).await;
    // The answer must not wait for the store: the jobs end by themselves once the station does.
    let jobs = app.jobs.clone();
    tokio::spawn(async move { jobs.stop_station_jobs(&actor).await });
    Json(StoppedDto {
        told: outcome.is_ok(),
        state: state_names(app.station.status().state).0,
        detail: outcome.err().map(|refusal| refusal.to_string()),
    })
}

/// Who stopped: the holder of the lease that came along, else the address.
fn actor(app: &App, headers: &HeaderMap, ip: Option<IpAddr>) -> String {
    match (app.control.actor(headers), ip) {
        (actor, Some(ip)) if actor == "rest" => format!("rest {ip}"),
        (actor, _) => actor,
    }
}

/// Acknowledges faults, reaches devices again, leaves Halted. Nothing moves or shines by it.
#[utoipa::path(
    post, path = "/station/reset", tag = "station",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = StationDto))
)]
async fn reset_station(State(app): State<App>, headers: HeaderMap) -> Result<Json<StationDto>, Problem> {
    app.control.authorize(&headers)?;
    app.station.manual(Manual::Reset).await?;
    Ok(Json(station(&app)))
}

/// Starts or ends the live view.
///
/// It ends by itself, and the laser with it, when nobody watches.
#[utoipa::path(
    put, path = "/station/live", tag = "station", request_body = SetLiveDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = StationDto))
)]
async fn set_live_view(
    State(app): State<App>,
    headers: HeaderMap,
    body: ApiJson<SetLiveDto>,
) -> Result<Json<StationDto>, Problem> {
    app.control.authorize(&headers)?;
    let SetLiveDto { running, laser_power } = body.value;
    check_laser_power(laser_power, "/laser_power")?;
    app.station.live(LiveRequest { running, laser_power }).await?;
    Ok(Json(station(&app)))
}
