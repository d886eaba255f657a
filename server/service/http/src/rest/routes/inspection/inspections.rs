//! Inspections: start, list, re-evaluate; hold and resume their queue.

use std::time::Duration;

use crate::Http;
use app::error::AppError;
use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use futures_util::{StreamExt as _, stream};
use store::{InspectionFilter, JobState};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::report_response;
use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{Reply, bytes};
use crate::rest::control::By;
use crate::rest::conversions::accepted;
use crate::rest::extract::{ApiJson, ApiPath, ApiQuery};
use crate::rest::idempotency::{Begun, begin};
use crate::wire::inspection::inspections::{InspectionDto, InspectionQueueDto};
use crate::wire::inspection::requests::{
    ExportFormatDto, ExportQuery, HoldDto, InspectDto, InspectionReportFormatDto, InspectionReportQuery,
    InspectionsQuery, ReEvaluateDto, WaitQuery,
};
use crate::wire::job::jobs::{JobDto, job_href};
use crate::wire::measurement::measurements::VerdictDto;
use crate::wire::paging::{ListDto, encoded, page, path_with};
use app::App;
use app::inspections::{
    Export, ExportFormat, InspectionMessage, ReportFormat, dfq_document, inspection_report, local,
};
use app::jobs::ScanSource;
use app::recipes::RecipeRef;
use app::use_cases;

/// Longest time that a response waits for a result.
const WAIT_LIMIT_S: u32 = 30;

/// Media type of DFQ files, which have none of their own.
const DFQ: &str = "application/octet-stream";

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_inspections, start_inspection))
        .routes(routes!(export_inspections))
        .routes(routes!(get_inspection))
        .routes(routes!(get_inspection_report))
        .routes(routes!(re_evaluate_inspection))
        .routes(routes!(get_inspection_queue))
        .routes(routes!(hold_inspections))
        .routes(routes!(resume_inspections))
}

/// Lists inspections, newest first; with `after_seq`, oldest first after that number.
#[utoipa::path(
    get, path = "/inspections", tag = "inspections", params(InspectionsQuery),
    responses((status = 200, body = ListDto<InspectionDto>))
)]
async fn list_inspections(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<InspectionsQuery>,
) -> Result<Json<ListDto<InspectionDto>>, Problem> {
    let page = page(query.before, query.limit)?;
    if query.after_seq.is_some() && page.before.is_some() {
        return Err(Problem::new(ProblemKind::BadRequest, "before and after_seq exclude each other")
            .at("query/before")
            .remedy("give one of them"));
    }
    let verdict = query.verdict.map(VerdictDto::code);
    let [serial, order, recipe] =
        [&query.serial, &query.order, &query.recipe].map(|text| text.as_deref().map(encoded));
    let [from_ms, to_ms] = [query.from_ms, query.to_ms].map(|ms| ms.map(|ms| ms.to_string()));
    let asked = [
        ("serial", serial.as_deref()),
        ("order", order.as_deref()),
        ("recipe", recipe.as_deref()),
        ("verdict", verdict),
        ("from_ms", from_ms.as_deref()),
        ("to_ms", to_ms.as_deref()),
    ];
    let path = path_with("/api/v1/inspections", &asked);
    let filter = InspectionFilter {
        serial: query.serial,
        order_number: query.order,
        verdict: verdict.map(str::to_owned),
        from_ms: query.from_ms,
        to_ms: query.to_ms,
        ..by_recipe(query.recipe)
    };
    let read = app.catalogue.read();
    let Some(seq) = query.after_seq else {
        let listed = read.inspections(&filter, &page).await?;
        return Ok(Json(ListDto::whole_of(&path, &page, listed, InspectionDto::in_list)));
    };
    let mut listed = read.inspections_after(&filter, seq, page.limit).await?;
    let joint = if path.contains('?') { '&' } else { '?' };
    let next = listed.next.take().map(|seq| format!("{path}{joint}after_seq={seq}&limit={}", page.limit));
    let list = ListDto::whole_of(&path, &page, listed, InspectionDto::in_list);
    Ok(Json(ListDto { next, ..list }))
}

/// The filter for a recipe, given as an id, alone or with a version.
fn by_recipe(recipe: Option<String>) -> InspectionFilter {
    let (recipe_id, recipe_version) = match recipe.as_deref().and_then(RecipeRef::parse) {
        Some(RecipeRef::Id { id, version }) => (Some(id), version),
        // No recipe has such an id: an empty list.
        _ => (recipe, None),
    };
    InspectionFilter { recipe_id, recipe_version, ..InspectionFilter::default() }
}

/// Exports the selected inspections as a file, oldest first. The response is a stream: an error of the store after its start ends the
/// connection.
#[utoipa::path(
    get, path = "/inspections/export", tag = "inspections", params(ExportQuery),
    responses((status = 200, content((String = "text/csv"), (Vec<u8> = "application/octet-stream"))))
)]
async fn export_inspections(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<ExportQuery>,
) -> Result<Response, Problem> {
    let (format, media_type, name) = match query.format.unwrap_or_default() {
        ExportFormatDto::Csv => (ExportFormat::Csv, "text/csv; charset=utf-8", "inspections.csv"),
        ExportFormatDto::Dfq => (ExportFormat::Dfq, DFQ, "inspections.dfq"),
    };
    let filter = InspectionFilter {
        serial: query.serial,
        order_number: query.order,
        verdict: query.verdict.map(|verdict| verdict.code().to_owned()),
        from_ms: query.from_ms,
        to_ms: query.to_ms,
        ..by_recipe(query.recipe)
    };
    let export = Export::begin(app.catalogue.read(), filter, format).await?;
    let first = export.page(app.catalogue.read(), 0).await?;
    let rest = stream::try_unfold((app, export, first.next_seq), |(app, export, next)| async move {
        let Some(seq) = next else { return Ok::<_, String>(None) };
        let page = export.page(app.catalogue.read(), seq).await.map_err(|error| error.detail)?;
        Ok(Some((page.bytes, (app, export, page.next_seq))))
    });
    let whole = stream::once(async { Ok(first.bytes) }).chain(rest);
    Ok(bytes(media_type, Some(name), Body::from_stream(whole)))
}

/// Inspects a part: scans it, or takes the frames of a capture, measures it according to a recipe, and decides its verdict. With `wait_s` the
/// response is the inspection if it is finished within that time, or the problem if the job fails.
#[utoipa::path(
    post, path = "/inspections", tag = "inspections", request_body = InspectDto, params(WaitQuery),
    responses(
        (status = 200, body = InspectionDto, description = "Finished within `wait_s`"),
        (status = 202, body = JobDto, headers(("Location" = String, description = "Address of the job")))
    )
)]
async fn start_inspection(
    State(app): State<App>,
    ApiQuery(wait): ApiQuery<WaitQuery>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<InspectDto>,
) -> Result<Reply, Problem> {
    let wait = limit_of(&wait)?;
    let reply = match begin(&app, &headers, "POST inspections", &body.body_sha256).await? {
        Begun::Answered(reply) => reply,
        Begun::Fresh(once) => {
            let recipe = body.value.recipe.clone().map(RecipeRef::try_from).transpose()?;
            let and = |record: &store::JobRecord| once.changes(&accepted(record));
            let source = body.value.source.clone().map(ScanSource::from).unwrap_or_default();
            accepted(&use_cases::inspect_from(&app, &by, source, recipe, body.value.part(), and).await?)
        }
    };
    waited(&app, reply, wait).await
}

/// Returns an inspection.
#[utoipa::path(
    get, path = "/inspections/{id}", tag = "inspections", params(("id" = String, Path)),
    responses((status = 200, body = InspectionDto))
)]
async fn get_inspection(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
) -> Result<Json<InspectionDto>, Problem> {
    Ok(Json(app.catalogue.read().inspection(&id).await?.try_into()?))
}

/// Returns the report of an inspection: verdict, characteristics with limits and uncertainties, the cloud from above, provenance;
/// or its values in the Q-DAS ASCII transfer format.
#[utoipa::path(
    get, path = "/inspections/{id}/report", tag = "inspections", params(("id" = String, Path), InspectionReportQuery),
    responses((
        status = 200,
        content((String = "text/html"), (Vec<u8> = "application/pdf"), (Vec<u8> = "application/octet-stream"))
    ))
)]
async fn get_inspection_report(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<InspectionReportQuery>,
) -> Result<Response, Problem> {
    let format = match query.format.unwrap_or_default() {
        InspectionReportFormatDto::Html => ReportFormat::Html,
        InspectionReportFormatDto::Pdf => ReportFormat::Pdf,
        InspectionReportFormatDto::Dfq => {
            let inspection: InspectionMessage =
                app.catalogue.read().inspection(&id).await.and_then(TryFrom::try_from)?;
            let name = format!("{}_{}.dfq", inspection.serial, inspection.seq);
            return Ok(bytes(DFQ, Some(&name), dfq_document(&inspection, local(inspection.inspected_at_ms))));
        }
    };
    let report = inspection_report(app.catalogue.read(), &*app.artifacts, &id, format).await?;
    Ok(report_response(format, report))
}

/// Re-evaluates the scan of an inspection with another version of a recipe or another calibration. The result is a new inspection that
/// refers to this one and lists the verdicts that changed; this one is not changed.
#[utoipa::path(
    post, path = "/inspections/{id}/re-evaluate", tag = "inspections", request_body = ReEvaluateDto,
    params(("id" = String, Path), WaitQuery),
    responses(
        (status = 200, body = InspectionDto, description = "Finished within `wait_s`"),
        (status = 202, body = JobDto, headers(("Location" = String, description = "Address of the job")))
    )
)]
async fn re_evaluate_inspection(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(wait): ApiQuery<WaitQuery>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<ReEvaluateDto>,
) -> Result<Reply, Problem> {
    let wait = limit_of(&wait)?;
    let route = format!("POST inspections/{id}/re-evaluate");
    let reply = match begin(&app, &headers, &route, &body.body_sha256).await? {
        Begun::Answered(reply) => reply,
        Begun::Fresh(once) => {
            let recipe = body.value.recipe.map(RecipeRef::try_from).transpose()?;
            let and = |record: &store::JobRecord| once.changes(&accepted(record));
            accepted(&use_cases::re_evaluate(&app, &by, &id, recipe, body.value.calibration_id, and).await?)
        }
    };
    waited(&app, reply, wait).await
}

fn limit_of(query: &WaitQuery) -> Result<Duration, Problem> {
    match query.wait_s.unwrap_or(0) {
        seconds @ 0..=WAIT_LIMIT_S => Ok(Duration::from_secs(seconds.into())),
        seconds => Err(Problem::new(ProblemKind::BadRequest, format!("{seconds} s are too long to wait"))
            .at("query/wait_s")
            .remedy(format!("wait at most {WAIT_LIMIT_S} s, then read the job"))),
    }
}

/// The inspection if its job ends in time, else the current state of the job.
async fn waited(app: &App, accepted: Reply, limit: Duration) -> Result<Reply, Problem> {
    if limit.is_zero() {
        return Ok(accepted);
    }
    let id = accepted.body["id"].as_str().unwrap_or_default().to_owned();
    let view = use_cases::wait_for_job(app, &id, limit).await?;
    let record = &view.record;
    match (record.state, &record.result) {
        (JobState::Queued | JobState::Running, _) => Ok(Reply::accepted(job_href(&id), &JobDto::from(view))),
        (JobState::Succeeded, Some(result)) => {
            let inspection = app.catalogue.read().inspection(&result.id).await?;
            Ok(Reply::done(None, &InspectionDto::try_from(inspection)?))
        }
        (JobState::Cancelled, _) => {
            Err(Problem::new(ProblemKind::Stopped, record.message.clone()).remedy("inspect the part again"))
        }
        (JobState::Interrupted, _) => {
            Err(Problem::new(ProblemKind::Unavailable, record.message.clone()).remedy("inspect the part again"))
        }
        (JobState::Succeeded | JobState::Failed, _) => {
            let problem =
                record.problem.clone().and_then(|problem| serde_json::from_value::<AppError>(problem).ok());
            Err(problem.map_or_else(|| Problem::new(ProblemKind::Damaged, record.message.clone()), Problem::from))
        }
    }
}

/// Returns the state of the inspection queue.
#[utoipa::path(
    get, path = "/inspection-queue", tag = "inspections",
    responses((status = 200, body = InspectionQueueDto))
)]
async fn get_inspection_queue(State(app): State<App>) -> Result<Json<InspectionQueueDto>, Problem> {
    Ok(Json(use_cases::inspection_queue(&app).await?.into()))
}

/// Holds the inspection queue: no further inspection starts until it is resumed, across restarts too; a running one completes. Other jobs are
/// not affected.
#[utoipa::path(
    post, path = "/inspection-queue/hold", tag = "inspections", request_body = HoldDto,
    responses((status = 200, body = InspectionQueueDto))
)]
async fn hold_inspections(
    State(app): State<App>,
    By(by): By,
    body: ApiJson<HoldDto>,
) -> Result<Json<InspectionQueueDto>, Problem> {
    use_cases::hold_inspections(&app, &by, body.value.reason).await?;
    Ok(Json(use_cases::inspection_queue(&app).await?.into()))
}

/// Resumes the inspection queue: waiting inspections start in order.
#[utoipa::path(
    post, path = "/inspection-queue/resume", tag = "inspections",
    responses((status = 200, body = InspectionQueueDto))
)]
async fn resume_inspections(State(app): State<App>, By(by): By) -> Result<Json<InspectionQueueDto>, Problem> {
    use_cases::resume_inspections(&app, &by).await?;
    Ok(Json(use_cases::inspection_queue(&app).await?.into()))
}
