//! CAD models: upload, list, download, delete.

use axum::Json;
use axum::body::Body;
use axum::extract::{RawQuery, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use store::ModelRecord;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::Http;
use crate::limits::{MODEL_BODY_LIMIT_BYTES, MODEL_BODY_TIMEOUT};
use crate::problem::Problem;
use crate::rest::answers::{Reply, artifact};
use crate::rest::control::By;
use crate::rest::extract::{ApiPath, ApiQuery, whole_body};
use crate::rest::idempotency::{Begun, enter, fingerprint, look_up};
use crate::wire::measurement::models::{ModelDto, ModelQuery, model_href};
use crate::wire::paging::{ListDto, PageQuery};
use app::use_cases;
use app::{App, hash_hex};

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_models, upload_model))
        .routes(routes!(get_model, delete_model))
        .routes(routes!(download_model))
}

/// Lists CAD models, newest first.
#[utoipa::path(
    get, path = "/models", tag = "recipes", params(PageQuery),
    responses((status = 200, body = ListDto<ModelDto>))
)]
async fn list_models(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<PageQuery>,
) -> Result<Json<ListDto<ModelDto>>, Problem> {
    let page = query.page()?;
    let records = app.catalogue.read().models(&page).await?;
    Ok(Json(ListDto::whole_of("/api/v1/models", &page, records, ModelDto::try_from)))
}

/// Uploads the CAD model of a part as STL, GLB or PLY, at most 64 MiB. STL and PLY are in millimetres, GLB in metres.
#[utoipa::path(
    post, path = "/models", tag = "recipes", params(ModelQuery),
    request_body(content = Vec<u8>, content_type = "application/octet-stream"),
    responses((status = 201, body = ModelDto))
)]
async fn upload_model(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<ModelQuery>,
    RawQuery(raw_query): RawQuery,
    By(by): By,
    headers: HeaderMap,
    body: Body,
) -> Result<Reply, Problem> {
    let flight = enter(&app, &headers, "POST models")?;
    let bytes = whole_body(body, MODEL_BODY_LIMIT_BYTES, MODEL_BODY_TIMEOUT).await?;
    let once = match look_up(&app, flight, &fingerprint(hash_hex(&bytes), raw_query.as_deref())).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let made = |record: &ModelRecord| {
        Ok::<_, Problem>(Reply::created(model_href(&record.id), &ModelDto::try_from(record.clone())?))
    };
    let and = |record: &ModelRecord| Ok::<_, Problem>(once.changes(&made(record)?));
    made(&use_cases::add_model(&app, &by, query.name, bytes, and).await?)
}

/// Returns a CAD model.
#[utoipa::path(
    get, path = "/models/{id}", tag = "recipes", params(("id" = String, Path)),
    responses((status = 200, body = ModelDto))
)]
async fn get_model(State(app): State<App>, ApiPath(id): ApiPath<String>) -> Result<Json<ModelDto>, Problem> {
    Ok(Json(app.catalogue.read().model(&id).await?.try_into()?))
}

/// Downloads the file of a CAD model as it was uploaded.
#[utoipa::path(
    get, path = "/models/{id}/file", tag = "recipes", params(("id" = String, Path)),
    responses((status = 200, content((Vec<u8> = "application/octet-stream"))))
)]
async fn download_model(State(app): State<App>, ApiPath(id): ApiPath<String>) -> Result<Response, Problem> {
    let record = app.catalogue.read().model(&id).await?;
    let what = format!("the file of model {id}");
    artifact(&app, &record.file, &what, "application/octet-stream", Some(&record.name)).await
}

/// Deletes a CAD model. Recipes that name it keep its file.
#[utoipa::path(
    delete, path = "/models/{id}", tag = "recipes", params(("id" = String, Path)),
    responses((status = 204, description = "Deleted"))
)]
async fn delete_model(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
) -> Result<StatusCode, Problem> {
    use_cases::delete_model(&app, &by, id).await?;
    Ok(StatusCode::NO_CONTENT)
}
