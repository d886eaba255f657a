//! The control lease.

use crate::Http;
use std::time::Instant;

use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::{Extension, Json};
use serde_json::json;
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
use app::ledger::event;

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
    let change = match &taken.from {
        Some(from) => {
            let body = json!({ "actor": holder, "source": source(peer.as_ref()), "from": from, "to": holder });
            event("control.taken_over", &holder, body)
        }
        None => event("control.taken", &holder, json!({ "actor": holder, "source": source(peer.as_ref()) })),
    };
    app.ledger.commit(vec![change]).await?;
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
        let body = json!({ "actor": lease.holder, "source": source(peer.as_ref()) });
        app.ledger.commit(vec![event("control.given_back", &lease.holder, body)]).await?;
    }
    Ok(StatusCode::NO_CONTENT)
}
