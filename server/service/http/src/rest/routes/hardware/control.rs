//! The control lease.

use crate::Http;
use std::time::Instant;

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::Reply;
use crate::rest::control::By;
use crate::rest::extract::ApiJson;
use crate::wire::hardware::control::{ControlDto, ControlLeaseDto, TakeControlDto};
use app::App;
use app::use_cases::{self, TakeControl};

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new().routes(routes!(get_control, take_control, renew_control, release_control))
}

/// Returns who is in control of the station.
#[utoipa::path(
    get, path = "/station/control", tag = "station",
    responses((status = 200, body = ControlDto), (status = 404, description = "No one is in control"))
)]
async fn get_control(State(app): State<App>) -> Result<Json<ControlDto>, Problem> {
    match app.control.present(Instant::now()) {
        Some(lease) => Ok(Json((&lease).into())),
        None => Err(Problem::new(ProblemKind::NotFound, "no one is in control of the station")),
    }
}

/// Takes control for five seconds; renew the lease with PUT. Taking over from another holder needs `take_over` and is
/// logged.
#[utoipa::path(
    post, path = "/station/control", tag = "station", request_body = TakeControlDto,
    responses((status = 201, body = ControlLeaseDto))
)]
async fn take_control(
    State(app): State<App>,
    By(by): By,
    body: ApiJson<TakeControlDto>,
) -> Result<Reply, Problem> {
    let TakeControlDto { holder, take_over } = body.value;
    let lease = use_cases::take_control(&app, &by, TakeControl { holder, take_over }).await?;
    Ok(Reply::created("/api/v1/station/control".to_owned(), &ControlLeaseDto::from(&lease)))
}

/// Renews the lease for five seconds. It expires two minutes after the last command in any case.
#[utoipa::path(
    put, path = "/station/control", tag = "station",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = ControlLeaseDto))
)]
async fn renew_control(State(app): State<App>, By(by): By) -> Result<Json<ControlLeaseDto>, Problem> {
    Ok(Json((&use_cases::renew_control(&app, &by)?).into()))
}

/// Releases control.
#[utoipa::path(
    delete, path = "/station/control", tag = "station",
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 204, description = "Released, or not held"))
)]
async fn release_control(State(app): State<App>, By(by): By) -> Result<StatusCode, Problem> {
    use_cases::release_control(&app, &by).await?;
    Ok(StatusCode::NO_CONTENT)
}
