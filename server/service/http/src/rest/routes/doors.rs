//! Doors to other systems: state, test, dead letters.

use crate::Http;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::Problem;
use crate::rest::answers::bytes;
use crate::rest::control::By;
use crate::rest::extract::{ApiPath, ApiQuery};
use crate::wire::doors::{DeliveriesQuery, DeliveryDto, DeliveryStateDto, DoorDto, DoorListDto, ResentDto};
use crate::wire::paging::{ListDto, page};
use app::App;
use app::use_cases::{self, Resend};

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_doors))
        .routes(routes!(get_door))
        .routes(routes!(get_register_map))
        .routes(routes!(test_door))
        .routes(routes!(list_deliveries))
        .routes(routes!(resend_dead))
        .routes(routes!(delete_delivery))
        .routes(routes!(resend_delivery))
}

/// Lists all doors with their state.
#[utoipa::path(get, path = "/doors", tag = "doors", responses((status = 200, body = DoorListDto)))]
async fn list_doors(State(app): State<App>) -> Result<Json<DoorListDto>, Problem> {
    let items = app.doors.list().await?.into_iter().map(DoorDto::from).collect();
    Ok(Json(DoorListDto { items }))
}

/// Returns the state of a door.
#[utoipa::path(
    get, path = "/doors/{name}", tag = "doors", params(("name" = String, Path)),
    responses((status = 200, body = DoorDto))
)]
async fn get_door(State(app): State<App>, ApiPath(name): ApiPath<String>) -> Result<Json<DoorDto>, Problem> {
    Ok(Json(app.doors.get(&name).await?.into()))
}

/// Returns the registers of a Modbus door as CSV (RFC 4180) for the tools of its PLC, one row per register.
#[utoipa::path(
    get, path = "/doors/{name}/registers", tag = "doors", params(("name" = String, Path)),
    responses((status = 200, body = String, content_type = "text/csv"))
)]
async fn get_register_map(State(app): State<App>, ApiPath(name): ApiPath<String>) -> Result<Response, Problem> {
    let map = app.doors.register_map(&name)?;
    Ok(bytes("text/csv; charset=utf-8", Some(&format!("{name}_registers.csv")), map))
}

/// Sends a test message through a door, past everything that waits, and returns its state. If the message is delivered,
/// what waits is tried at once.
#[utoipa::path(
    post, path = "/doors/{name}/test", tag = "doors", params(("name" = String, Path)),
    responses((status = 200, body = DoorDto))
)]
async fn test_door(State(app): State<App>, ApiPath(name): ApiPath<String>) -> Result<Json<DoorDto>, Problem> {
    app.doors.test(&name).await?;
    Ok(Json(app.doors.get(&name).await?.into()))
}

/// Lists the deliveries that a door has set aside, oldest first.
#[utoipa::path(
    get, path = "/doors/{name}/deliveries", tag = "doors", params(("name" = String, Path), DeliveriesQuery),
    responses((status = 200, body = ListDto<DeliveryDto>))
)]
async fn list_deliveries(
    State(app): State<App>,
    ApiPath(name): ApiPath<String>,
    ApiQuery(query): ApiQuery<DeliveriesQuery>,
) -> Result<Json<ListDto<DeliveryDto>>, Problem> {
    let page = page(None, query.limit)?;
    let state = query.state.map(Into::into);
    let mut listed = app.doors.deliveries(&name, state, query.after_seq.unwrap_or(0), page.limit).await?;
    let next = listed.next.take().map(|seq| {
        let state = match query.state {
            None => "",
            Some(DeliveryStateDto::Waiting) => "state=waiting&",
            Some(DeliveryStateDto::Dead) => "state=dead&",
        };
        format!("/api/v1/doors/{name}/deliveries?{state}after_seq={seq}&limit={}", page.limit)
    });
    let list = ListDto::new("", &page, listed, DeliveryDto::from);
    Ok(Json(ListDto { next, ..list }))
}

/// Delivers all dead letters of a door again, oldest first, at most 1000 at a time.
#[utoipa::path(
    post, path = "/doors/{name}/resend-dead", tag = "doors", params(("name" = String, Path)),
    responses((status = 200, body = ResentDto))
)]
async fn resend_dead(
    State(app): State<App>,
    ApiPath(name): ApiPath<String>,
    By(by): By,
) -> Result<Json<ResentDto>, Problem> {
    let seqs = use_cases::resend(&app, &by, &name, Resend::AllDead).await?;
    Ok(Json(ResentDto { seqs }))
}

/// Delivers an event that was set aside again at once, whether it waits or is a dead letter.
#[utoipa::path(
    post, path = "/doors/{name}/deliveries/{seq}/resend", tag = "doors",
    params(("name" = String, Path), ("seq" = i64, Path)), responses((status = 200, body = ResentDto))
)]
async fn resend_delivery(
    State(app): State<App>,
    ApiPath((name, seq)): ApiPath<(String, i64)>,
    By(by): By,
) -> Result<Json<ResentDto>, Problem> {
    let seqs = use_cases::resend(&app, &by, &name, Resend::One(seq)).await?;
    Ok(Json(ResentDto { seqs }))
}

/// Deletes a delivery that was set aside: it is never made.
#[utoipa::path(
    delete, path = "/doors/{name}/deliveries/{seq}", tag = "doors",
    params(("name" = String, Path), ("seq" = i64, Path)), responses((status = 204))
)]
async fn delete_delivery(
    State(app): State<App>,
    ApiPath((name, seq)): ApiPath<(String, i64)>,
    By(by): By,
) -> Result<StatusCode, Problem> {
    use_cases::delete_delivery(&app, &by, &name, seq).await?;
    Ok(StatusCode::NO_CONTENT)
}
