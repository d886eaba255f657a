//! Recordings: start, stop, list, download, delete.

use crate::Http;
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use store::RecordingRecord;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::Reply;
use crate::rest::control::By;
use crate::rest::extract::{ApiJson, ApiPath, ApiQuery};
use crate::rest::idempotency::{Begun, begin};
use crate::rest::ranges::ranged_artifact;
use crate::wire::paging::{ListDto, PageQuery};
use crate::wire::scan::recordings::{RecordingDto, StartRecordingDto, recording_href};
use app::App;
use app::use_cases;

/// The media type of MCAP files.
const MCAP: &str = "application/octet-stream";

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_recordings, start_recording))
        .routes(routes!(get_recording, delete_recording))
        .routes(routes!(stop_recording))
        .routes(routes!(download_recording))
}

/// Lists recordings, newest first.
#[utoipa::path(
    get, path = "/recordings", tag = "recordings", params(PageQuery),
    responses((status = 200, body = ListDto<RecordingDto>))
)]
async fn list_recordings(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<PageQuery>,
) -> Result<Json<ListDto<RecordingDto>>, Problem> {
    let page = query.page()?;
    let records = app.catalogue.read().recordings(&page).await?.map(|record| app.recordings.now(record));
    Ok(Json(ListDto::whole_of("/api/v1/recordings", &page, records, RecordingDto::try_from)))
}

/// Starts recording the live view: every frame that the camera delivers, losslessly, with devices, stage, events, lines
/// and profiles. The recording ends when it is stopped, when the live view ends, or when free disk space reaches its
/// lower limit. To record a scan, set `record` in the scan request.
#[utoipa::path(
    post, path = "/recordings", tag = "recordings", request_body = StartRecordingDto,
    params(("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 201, body = RecordingDto))
)]
async fn start_recording(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<StartRecordingDto>,
) -> Result<Reply, Problem> {
    let once = match begin(&app, &headers, "POST recordings", &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let name = body.value.name.unwrap_or_else(|| "live view".to_owned());
    let made = |record: &RecordingRecord| {
        let dto = RecordingDto::try_from(record.clone())?;
        Ok::<_, Problem>(Reply::created(recording_href(&record.id), &dto))
    };
    let and = |record: &RecordingRecord| Ok::<_, Problem>(once.changes(&made(record)?));
    made(&use_cases::start_recording(&app, &by, &name, and).await?)
}

/// Returns a recording; while it runs, with the figures so far.
#[utoipa::path(
    get, path = "/recordings/{id}", tag = "recordings", params(("id" = String, Path)),
    responses((status = 200, body = RecordingDto))
)]
async fn get_recording(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
) -> Result<Json<RecordingDto>, Problem> {
    let record = app.recordings.now(app.catalogue.read().recording(&id).await?);
    Ok(Json(record.try_into()?))
}

/// Stops a recording; responds when its file is complete. A recording that has ended is not changed.
#[utoipa::path(
    post, path = "/recordings/{id}/stop", tag = "recordings",
    params(("id" = String, Path), ("Sheaf-Control" = String, Header, description = "Id of the control lease")),
    responses((status = 200, body = RecordingDto))
)]
async fn stop_recording(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
) -> Result<Json<RecordingDto>, Problem> {
    Ok(Json(use_cases::stop_recording(&app, &by, &id).await?.try_into()?))
}

/// Downloads the MCAP file, whole or in ranges, for Foxglove, Rerun, `sheaf recording` or `station.replay`.
#[utoipa::path(
    get, path = "/recordings/{id}/file", tag = "recordings",
    params(("id" = String, Path), ("Range" = Option<String>, Header, description = "A single byte range")),
    responses(
        (status = 200, content((Vec<u8> = "application/octet-stream"))),
        (status = 206, description = "The requested range", content((Vec<u8> = "application/octet-stream")))
    )
)]
async fn download_recording(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let record = app.catalogue.read().recording(&id).await?;
    let Some(file) = &record.file else {
        return Err(Problem::new(ProblemKind::Conflict, format!("recording {id} has no file yet"))
            .remedy("stop it first, and wait until its file is complete"));
    };
    let (what, name) = (format!("the file of recording {id}"), format!("{}.mcap", record.name));
    ranged_artifact(&app, file, &what, MCAP, &name, &headers).await
}

/// Deletes a recording and frees its disk space. A running recording must be stopped first.
#[utoipa::path(
    delete, path = "/recordings/{id}", tag = "recordings", params(("id" = String, Path)),
    responses((status = 204, description = "Deleted"))
)]
async fn delete_recording(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
) -> Result<StatusCode, Problem> {
    use_cases::delete_recording(&app, &by, id).await?;
    Ok(StatusCode::NO_CONTENT)
}
