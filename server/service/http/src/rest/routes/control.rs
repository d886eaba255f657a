//! The control lease.

use crate::Http;
use app::events::{Act, Event, TakenOver, event};
use std::time::Instant;

use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::{Extension, Json};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::edge::{Peer, source};
use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{Reply, header_text};
use crate::rest::control::CONTROL_HEADER;
use crate::rest::extract::ApiJson;
use crate::wire::control::{ControlDto, ControlLeaseDto, TakeControlDto};
use app::App;
use app::labels::label;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new().routes(routes!(get_control, take_control, renew_control, give_control_back))
}

/// Who commands the station.
#[utoipa::path(
    get, path = "/station/control", tag = "station",
    responses((status = 200, body = ControlDto), (status = 404, description = "Nobody does"))
)]
async fn get_control(State(app): State<App>) -> Result<Json<ControlDto>, Problem> {
    match app.control.present(Instant::now()) {
        Some(lease) => Ok(Json((&lease).into())),
        None => Err(Problem::new(ProblemKind::NotFound, "nobody controls the station")),
    }
}

/// Takes control for five seconds; renew it with PUT. Taking it from somebody else is said explicitly and logged.
#[utoipa::path(
    post, path = "/station/control", tag = "station", request_body = TakeControlDto,
    responses((status = 201, body = ControlLeaseDto))
)]
async fn take_control(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    body: ApiJson<TakeControlDto>,
) -> Result<Reply, Problem> {
    let TakeControlDto { holder, take_over } = body.value;
    label(&holder, "/holder")?;
    let taken = app.control.take(&holder, take_over, Instant::now())?;
    let act = Act { actor: holder.clone(), source: source(peer.as_ref()) };
    let told = match &taken.from {
        Some(from) => Event::ControlTakenOver(TakenOver { act, from: from.clone(), to: holder.clone() }),
        None => Event::ControlTaken(act),
    };
    app.ledger.commit(vec![event(&holder, told)]).await?;
    Ok(Reply::created("/api/v1/station/control".to_owned(), &ControlLeaseDto::from(&taken.lease)))
}

/// Keeps control for five more seconds; it lapses two minutes after the last command all the same.
#[utoipa::path(
    put, path = "/station/control", tag = "station",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = ControlLeaseDto))
)]
async fn renew_control(State(app): State<App>, headers: HeaderMap) -> Result<Json<ControlLeaseDto>, Problem> {
    let id = header_text(&headers, &CONTROL_HEADER)?;
    Ok(Json((&app.control.renew(id.as_deref(), Instant::now())?).into()))
}

/// Gives control back.
#[utoipa::path(
    delete, path = "/station/control", tag = "station",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 204, description = "Given back, or not held"))
)]
async fn give_control_back(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    headers: HeaderMap,
) -> Result<StatusCode, Problem> {
    if let Some(lease) = app.control.give_back(header_text(&headers, &CONTROL_HEADER)?.as_deref()) {
        let act = Act { actor: lease.holder.clone(), source: source(peer.as_ref()) };
        app.ledger.commit(vec![event(&lease.holder, Event::ControlGivenBack(act))]).await?;
    }
    Ok(StatusCode::NO_CONTENT)
}
