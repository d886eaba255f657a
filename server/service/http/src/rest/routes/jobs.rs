//! Jobs: list, get, cancel.

use crate::Http;
use axum::Json;
use axum::extract::State;
use serde::Deserialize;
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::Problem;
use crate::rest::control::By;
use crate::rest::extract::{ApiPath, ApiQuery};
use crate::wire::job::jobs::{JobDto, JobStateDto};
use crate::wire::paging::{ListDto, page};
use app::App;
use app::use_cases;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new().routes(routes!(list_jobs)).routes(routes!(get_job)).routes(routes!(cancel_job))
}

/// Selects jobs.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct JobsQuery {
    /// Only jobs in this state.
    state: Option<JobStateDto>,
    /// Id of the last job of the previous page.
    before: Option<String>,
    /// Jobs per page, 1 to 200; default 50.
    #[param(minimum = 1, maximum = 200)]
    limit: Option<u32>,
}

/// Lists jobs, newest first.
#[utoipa::path(get, path = "/jobs", tag = "jobs", params(JobsQuery), responses((status = 200, body = ListDto<JobDto>)))]
async fn list_jobs(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<JobsQuery>,
) -> Result<Json<ListDto<JobDto>>, Problem> {
    let page = page(query.before, query.limit)?;
    let path = match query.state {
        Some(state) => {
            let word = serde_json::to_value(state).unwrap_or_default();
            format!("/api/v1/jobs?state={}", word.as_str().unwrap_or_default())
        }
        None => "/api/v1/jobs".to_owned(),
    };
    let views = app.jobs.list(query.state.map(store::JobState::from), &page).await?;
    Ok(Json(ListDto::new(&path, &page, views, JobDto::from)))
}

/// Returns a job.
#[utoipa::path(
    get, path = "/jobs/{id}", tag = "jobs", params(("id" = String, Path)),
    responses((status = 200, body = JobDto))
)]
async fn get_job(State(app): State<App>, ApiPath(id): ApiPath<String>) -> Result<Json<JobDto>, Problem> {
    Ok(Json(app.jobs.view(&id).await?.into()))
}

/// Cancels a job. A job that has already ended is not changed. While someone is in control, only they can cancel a job
/// that needs the station.
#[utoipa::path(
    post, path = "/jobs/{id}/cancel", tag = "jobs", params(("id" = String, Path)),
    responses((status = 200, body = JobDto))
)]
async fn cancel_job(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
) -> Result<Json<JobDto>, Problem> {
    Ok(Json(use_cases::cancel_job(&app, &by, &id).await?.into()))
}
