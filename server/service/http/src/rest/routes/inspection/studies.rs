//! Studies of how well the station measures: acceptance tests, type-1 studies, gauge R&R.

use crate::Http;
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::{report_format, report_response};
use crate::problem::Problem;
use crate::rest::answers::Reply;
use crate::rest::control::By;
use crate::rest::extract::{ApiJson, ApiPath, ApiQuery};
use crate::rest::idempotency::{Begun, begin};
use crate::wire::inspection::requests::ReportQuery;
use crate::wire::paging::{ListDto, PageQuery};
use crate::wire::study::requests::{AddPositionDto, CreateStudyDto};
use crate::wire::study::studies::{StudyDto, StudyItemDto, study_href};
use app::App;
use app::studies::{Study, StudyPlan, outcome, outcome_without_inspections, study_report};
use app::use_cases;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_studies, create_study))
        .routes(routes!(get_study, delete_study))
        .routes(routes!(add_study_position))
        .routes(routes!(get_study_report))
}

/// 201 with a study that was created, or got a position.
fn created(study: &Study) -> Reply {
    let outcome = outcome_without_inspections(study);
    Reply::created(study_href(&study.id), &StudyDto::new(study.clone(), outcome))
}

/// Lists studies, newest first.
#[utoipa::path(
    get, path = "/studies", tag = "studies", params(PageQuery),
    responses((status = 200, body = ListDto<StudyItemDto>))
)]
async fn list_studies(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<PageQuery>,
) -> Result<Json<ListDto<StudyItemDto>>, Problem> {
    let page = query.page()?;
    let listed = app.catalogue.read().studies(&page).await?;
    Ok(Json(ListDto::whole_of("/api/v1/studies", &page, listed, StudyItemDto::in_list)))
}

/// Creates a study: an acceptance test, which then gets its positions, or a study of the inspections that are made from now on.
#[utoipa::path(
    post, path = "/studies", tag = "studies", request_body = CreateStudyDto,
    responses((status = 201, body = StudyDto, headers(("Location" = String, description = "Its address"))))
)]
async fn create_study(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<CreateStudyDto>,
) -> Result<Reply, Problem> {
    let once = match begin(&app, &headers, "POST studies", &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let CreateStudyDto { name, plan } = body.value;
    let plan = StudyPlan::try_from(plan)?;
    let and = |study: &Study| once.changes(&created(study));
    Ok(created(&use_cases::create_study(&app, &by, (name, plan), and).await?))
}

/// Returns a study: its plan, what was found so far, what is still missing, the verdict.
#[utoipa::path(
    get, path = "/studies/{id}", tag = "studies", params(("id" = String, Path)),
    responses((status = 200, body = StudyDto))
)]
async fn get_study(State(app): State<App>, ApiPath(id): ApiPath<String>) -> Result<Json<StudyDto>, Problem> {
    let study = Study::of(app.catalogue.read().study(&id).await?)?;
    let outcome = outcome(app.catalogue.read(), &study).await?;
    Ok(Json(StudyDto::new(study, outcome)))
}

/// Deletes a study; scans and inspections remain.
#[utoipa::path(
    delete, path = "/studies/{id}", tag = "studies", params(("id" = String, Path)),
    responses((status = 204, description = "Deleted"))
)]
async fn delete_study(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
) -> Result<StatusCode, Problem> {
    use_cases::delete_study(&app, &by, id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Adds a scan of an artefact to an acceptance test; responds when its figures are determined, which takes some seconds. A position
/// cannot be removed: a test contains all that was measured.
#[utoipa::path(
    post, path = "/studies/{id}/positions", tag = "studies", params(("id" = String, Path)),
    request_body = AddPositionDto,
    responses((status = 201, body = StudyDto, headers(("Location" = String, description = "Address of the study"))))
)]
async fn add_study_position(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<AddPositionDto>,
) -> Result<Reply, Problem> {
    let route = format!("POST studies/{id}/positions");
    let once = match begin(&app, &headers, &route, &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let and = |study: &Study| once.changes(&created(study));
    Ok(created(&use_cases::add_position(&app, &by, &id, body.value.into(), and).await?))
}

/// Returns the report of a study: verdict, criteria, tables, charts, what is still missing.
#[utoipa::path(
    get, path = "/studies/{id}/report", tag = "studies", params(("id" = String, Path), ReportQuery),
    responses((status = 200, content((String = "text/html"), (Vec<u8> = "application/pdf"))))
)]
async fn get_study_report(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<ReportQuery>,
) -> Result<Response, Problem> {
    let format = report_format(&query);
    let report = study_report(app.catalogue.read(), &id, format).await?;
    Ok(report_response(format, report))
}
