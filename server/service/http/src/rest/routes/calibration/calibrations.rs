//! Calibrations: computed by jobs, activated explicitly.

use crate::Http;
use app::error::AppError;
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::Response;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{Reply, artifact, bytes};
use crate::rest::around::headers::CSP_REPORT;
use crate::rest::control::By;
use crate::rest::conversions::accept_job;
use crate::rest::etag::{Versioned, check_if_given};
use crate::rest::extract::{ApiJson, ApiPath, ApiQuery};
use crate::rest::idempotency::at_most_once;
use crate::wire::calibration::calibrations::{
    ActivateCalibrationDto, ActivationDto, ActiveCalibrationDto, CalibrationDto, CalibrationItemDto,
    CalibrationReportFormatDto, CalibrationReportQuery, StartCalibrationDto,
};
use crate::wire::calibration::differences::{CalibrationDifferenceDto, DiffQuery};
use crate::wire::calibration::residuals::ResidualsDto;
use crate::wire::job::jobs::JobDto;
use crate::wire::paging::{ListDto, PageQuery};
use app::App;
use app::calibrations::certificate::stored_certificate;
use app::calibrations::residuals::stored_residuals;
use app::hash_hex;
use app::jobs::JobInput;
use app::use_cases::{Activate, activate, roll_back};
use station::wall_clock::now_ms;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_calibrations, start_calibration))
        .routes(routes!(get_active_calibration, activate_calibration))
        .routes(routes!(roll_back_activation))
        .routes(routes!(list_activations))
        .routes(routes!(get_calibration))
        .routes(routes!(get_calibration_report))
        .routes(routes!(get_calibration_residuals))
        .routes(routes!(diff_calibrations))
}

/// Lists calibrations, newest first.
#[utoipa::path(
    get, path = "/calibrations", tag = "calibrations", params(PageQuery),
    responses((status = 200, body = ListDto<CalibrationItemDto>))
)]
async fn list_calibrations(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<PageQuery>,
) -> Result<Json<ListDto<CalibrationItemDto>>, Problem> {
    let page = query.page()?;
    let active = active_id(&app).await?;
    let records = app.catalogue.read().calibrations(&page).await?;
    let dto = |record| CalibrationItemDto::new(record, active.as_deref());
    Ok(Json(ListDto::whole_of("/api/v1/calibrations", &page, records, dto)))
}

async fn active_id(app: &App) -> Result<Option<String>, Problem> {
    Ok(app.catalogue.read().active().await?.and_then(|activation| activation.calibration_id))
}

/// Starts a calibration job. Its result is a draft; activate it with a separate request.
#[utoipa::path(
    post, path = "/calibrations", tag = "calibrations", request_body = StartCalibrationDto,
    responses((status = 202, body = JobDto, headers(("Location" = String, description = "Address of the job"))))
)]
async fn start_calibration(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<StartCalibrationDto>,
) -> Result<Reply, Problem> {
    let input = JobInput::Calibration(body.value.into());
    accept_job(&app, &by, &headers, "POST calibrations", &body.sha256, input).await
}

/// Returns a calibration with its document.
#[utoipa::path(
    get, path = "/calibrations/{id}", tag = "calibrations", params(("id" = String, Path)),
    responses((status = 200, body = CalibrationDto))
)]
async fn get_calibration(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
) -> Result<Json<CalibrationDto>, Problem> {
    let record = app.catalogue.read().calibration(&id).await?;
    let what = format!("the document of calibration {id}");
    let document =
        app.artifacts.read(&record.document).await.map_err(|error| AppError::from(error).of_stored(&what))?;
    let calibration =
        serde_json::from_slice(&document).map_err(|cause| AppError::damaged(&what, cause.to_string()))?;
    let active = active_id(&app).await?;
    Ok(Json(CalibrationDto { item: CalibrationItemDto::new(record, active.as_deref())?, calibration }))
}

/// Returns the report of a calibration: residuals, tables and images as an HTML page, or a Digital Calibration Certificate
/// (DCC, XML) by the `certificate` settings of the configuration.
#[utoipa::path(
    get, path = "/calibrations/{id}/report", tag = "calibrations",
    params(("id" = String, Path), CalibrationReportQuery),
    responses((status = 200, content((String = "text/html"), (String = "application/xml"))))
)]
async fn get_calibration_report(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<CalibrationReportQuery>,
) -> Result<Response, Problem> {
    match query.format.unwrap_or_default() {
        CalibrationReportFormatDto::Html => stored_page(&app, &id).await,
        CalibrationReportFormatDto::Dcc => {
            let issuer = &app.config.issuer;
            let certificate = stored_certificate(&app.catalogue, &*app.artifacts, issuer, &id, now_ms()).await?;
            Ok(bytes("application/xml", Some(&format!("calibration-{id}.xml")), certificate))
        }
    }
}

/// The page that was written with the calibration.
async fn stored_page(app: &App, id: &str) -> Result<Response, Problem> {
    let record = app.catalogue.read().calibration(id).await?;
    let report = record.report.ok_or_else(|| {
        Problem::new(ProblemKind::NotFound, "this calibration has no report").remedy("calibrate again")
    })?;
    let what = format!("the report of calibration {id}");
    let mut response = artifact(app, &report, &what, "text/html; charset=utf-8", None).await?;
    response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(CSP_REPORT));
    Ok(response)
}

/// Returns the residuals of a calibration, point by point, for residual maps.
#[utoipa::path(
    get, path = "/calibrations/{id}/residuals", tag = "calibrations", params(("id" = String, Path)),
    responses((status = 200, body = ResidualsDto))
)]
async fn get_calibration_residuals(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
) -> Result<Json<ResidualsDto>, Problem> {
    let record = app.catalogue.read().calibration(&id).await?;
    Ok(Json(stored_residuals(&*app.artifacts, &record).await?.into()))
}

/// Returns the active calibration. Its `ETag` may be sent as `If-Match` when another one is activated.
#[utoipa::path(
    get, path = "/calibrations/active", tag = "calibrations",
    responses((status = 200, body = ActiveCalibrationDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn get_active_calibration(State(app): State<App>) -> Result<Versioned<Json<ActiveCalibrationDto>>, Problem> {
    let active = app.catalogue.read().active().await?;
    Ok(Versioned(active_version(active.as_ref()), Json(active.into())))
}

fn active_version(active: Option<&store::ActivationRecord>) -> String {
    format!("activation-{}", active.map_or(0, |activation| activation.seq))
}

/// Lists the activation log, newest first.
#[utoipa::path(
    get, path = "/calibrations/activations", tag = "calibrations", params(PageQuery),
    responses((status = 200, body = ListDto<ActivationDto>))
)]
async fn list_activations(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<PageQuery>,
) -> Result<Json<ListDto<ActivationDto>>, Problem> {
    let page = query.page()?;
    let records = app.catalogue.read().activations(&page).await?;
    Ok(Json(ListDto::new("/api/v1/calibrations/activations", &page, records, ActivationDto::from)))
}

/// Activates a calibration; the activation is logged. Refused with 409 if its latest verification is not `ok`, unless the
/// request says `despite_verification`.
#[utoipa::path(
    put, path = "/calibrations/active", tag = "calibrations", request_body = ActivateCalibrationDto,
    params(
        ("If-Match" = Option<String>, Header, description = "ETag of the active calibration"),
        ("Sheaf-Actor" = Option<String>, Header, description = "Name for the log; not needed with a control lease"),
    ),
    responses((status = 200, body = ActiveCalibrationDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn activate_calibration(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<ActivateCalibrationDto>,
) -> Result<Versioned<Json<ActiveCalibrationDto>>, Problem> {
    let active = app.catalogue.read().active().await?;
    check_if_given(&headers, &active_version(active.as_ref()))?;
    let sure = headers.contains_key(header::IF_MATCH);
    let expected = sure.then(|| active.and_then(|activation| activation.calibration_id));
    let ActivateCalibrationDto { calibration_id, despite_verification } = body.value;
    let act = activate(&app, &by, Activate { calibration_id, expected, despite_verification }).await?;
    Ok(Versioned(active_version(Some(&act)), Json(Some(act).into())))
}

/// Rolls back the last activation; the roll-back is logged.
#[utoipa::path(
    post, path = "/calibrations/active/roll-back", tag = "calibrations",
    params((
        "Sheaf-Actor" = Option<String>, Header, description = "Name for the log; not needed with a control lease"
    )),
    responses((status = 200, body = ActiveCalibrationDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn roll_back_activation(State(app): State<App>, By(by): By, headers: HeaderMap) -> Result<Reply, Problem> {
    at_most_once(&app, &headers, "POST calibrations/active/roll-back", &hash_hex(&[]), async {
        let act = roll_back(&app, &by).await?;
        Ok(Reply::done(Some(active_version(Some(&act))), &ActiveCalibrationDto::from(Some(act))))
    })
    .await
}

/// Compares two calibrations: depth difference in mm over the working volume.
#[utoipa::path(
    get, path = "/calibrations/{id}/diff", tag = "calibrations", params(("id" = String, Path), DiffQuery),
    responses((status = 200, body = CalibrationDifferenceDto))
)]
async fn diff_calibrations(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<DiffQuery>,
) -> Result<Json<CalibrationDifferenceDto>, Problem> {
    let difference = app.calibrations.difference(&id, &query.with).await?;
    Ok(Json(CalibrationDifferenceDto::new(id, query.with, difference)))
}
