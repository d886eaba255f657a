//! Captures: upload, list, download, delete.

use crate::Http;
use std::path::{Path, PathBuf};

use axum::Json;
use axum::body::{Body, BodyDataStream};
use axum::extract::{RawQuery, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::Response;
use futures_util::StreamExt as _;
use serde::Deserialize;
use sha2::{Digest as _, Sha256};
use store::CaptureRecord;
use tokio::fs::File;
use tokio::io::AsyncWriteExt as _;
use tokio::time::{Instant, timeout, timeout_at};
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use uuid::Uuid;

use crate::limits::{
    REFUSED_UPLOAD_PATIENCE, UPLOAD_LIMIT_BYTES, UPLOAD_ROOM_STEP_BYTES, UPLOAD_WINDOW, UPLOAD_WINDOW_MIN_BYTES,
};
use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{Reply, artifact};
use crate::rest::control::By;
use crate::rest::conversions::label;
use crate::rest::extract::{ApiPath, ApiQuery, media_type};
use crate::rest::idempotency::{Begun, enter, fingerprint, look_up};
use crate::wire::paging::{ListDto, PageQuery};
use crate::wire::scan::captures::{CaptureDto, capture_href};
use app::App;
use app::captures::{ArchiveFormat, free_bytes};
use app::jobs::FREE_FLOOR_BYTES;
use app::use_cases::{self, Upload, upload};

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_captures, upload_capture))
        .routes(routes!(get_capture, delete_capture))
        .routes(routes!(download_capture))
}

/// Name of the upload.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct UploadQuery {
    /// Its name; default `upload`.
    #[param(min_length = 1, max_length = 100)]
    name: Option<String>,
}

/// Lists captures, newest first.
#[utoipa::path(
    get, path = "/captures", tag = "captures", params(PageQuery),
    responses((status = 200, body = ListDto<CaptureDto>))
)]
async fn list_captures(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<PageQuery>,
) -> Result<Json<ListDto<CaptureDto>>, Problem> {
    let page = query.page()?;
    let records = app.catalogue.read().captures(&page).await?;
    Ok(Json(ListDto::whole_of("/api/v1/captures", &page, records, CaptureDto::try_from)))
}

/// Uploads a capture folder as ZIP or TAR, at most 2 GiB. Every image is checked before the response.
#[utoipa::path(
    post, path = "/captures", tag = "captures", params(UploadQuery),
    request_body(content((Vec<u8> = "application/zip"), (Vec<u8> = "application/x-tar"))),
    responses((status = 201, body = CaptureDto))
)]
async fn upload_capture(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<UploadQuery>,
    RawQuery(raw_query): RawQuery,
    By(by): By,
    headers: HeaderMap,
    body: Body,
) -> Result<Reply, Problem> {
    let format = archive_format(&headers)?;
    let name = query.name.unwrap_or_else(|| "upload".to_owned());
    label(&name, "query/name")?;
    let flight = enter(&app, &headers, "POST captures")?;
    refuse_too_large(&headers)?;
    let folder = app.artifacts.workbench().scratch();
    refuse_without_room(folder, stated_bytes(&headers).unwrap_or(0))?;
    let archive = Scratch(folder.join(format!("upload-{}", Uuid::now_v7())));
    let mut body = body.into_data_stream();
    let sha256 = match receive(&mut body, &archive.0, || refuse_without_room(folder, 0)).await {
        Ok(sha256) => sha256,
        Err(problem) => {
            drop(archive);
            if problem.status != StatusCode::REQUEST_TIMEOUT.as_u16() {
                drain_body(body).await;
            }
            return Err(problem);
        }
    };
    let once = match look_up(&app, flight, &fingerprint(sha256, raw_query.as_deref())).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let input = Upload { archive: archive.0.clone(), format, name };
    let made = |record: &CaptureRecord| {
        Ok::<_, Problem>(Reply::created(capture_href(&record.id), &CaptureDto::try_from(record.clone())?))
    };
    let record = upload(&app, &by, input, |record| Ok::<_, Problem>(once.changes(&made(record)?))).await?;
    made(&record)
}

fn archive_format(headers: &HeaderMap) -> Result<ArchiveFormat, Problem> {
    let media = media_type(headers);
    match media.as_deref() {
        Some("application/zip" | "application/x-zip-compressed") => Ok(ArchiveFormat::Zip),
        Some("application/x-tar" | "application/tar") => Ok(ArchiveFormat::Tar),
        other => Err(Problem::new(
            ProblemKind::UnsupportedMediaType,
            format!("a capture cannot be read from {}", other.unwrap_or("an untyped body")),
        )
        .remedy("send application/zip or application/x-tar")),
    }
}

fn too_large() -> Problem {
    Problem::new(ProblemKind::TooLarge, format!("the archive has more than {UPLOAD_LIMIT_BYTES} bytes"))
        .remedy("upload fewer scans at once")
}

fn stated_bytes(headers: &HeaderMap) -> Option<u64> {
    headers.get(header::CONTENT_LENGTH)?.to_str().ok()?.parse().ok()
}

fn refuse_too_large(headers: &HeaderMap) -> Result<(), Problem> {
    if stated_bytes(headers).is_some_and(|bytes| bytes > UPLOAD_LIMIT_BYTES) { Err(too_large()) } else { Ok(()) }
}

/// Uploads keep the same free space as jobs do: for the catalogue, its log and deletions.
fn refuse_without_room(folder: &Path, coming_bytes: u64) -> Result<(), Problem> {
    let (needed_bytes, free_bytes) = (FREE_FLOOR_BYTES.saturating_add(coming_bytes), free_bytes(folder));
    if free_bytes >= needed_bytes {
        return Ok(());
    }
    let detail =
        format!("the upload needs {} MiB of disk space, {} MiB are free", needed_bytes >> 20, free_bytes >> 20);
    Err(Problem::new(ProblemKind::StorageFull, detail)
        .remedy("delete captures or scans that are no longer needed"))
}

/// Reads and discards the rest of a refused upload, so that the client reads the response instead of a broken pipe. Not
/// done after a timeout: nothing is in flight then.
async fn drain_body(mut body: BodyDataStream) {
    let rest = async { while let Some(Ok(_)) = body.next().await {} };
    // A client that sends for longer finds the connection closed.
    let _ = timeout(REFUSED_UPLOAD_PATIENCE, rest).await;
}

/// A temporary file; deleted on drop unless it was moved away.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // Missing if it was moved into the store.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Streams the body to `path` as long as `room` finds free space; returns its SHA-256.
async fn receive(
    body: &mut BodyDataStream,
    path: &Path,
    room: impl Fn() -> Result<(), Problem>,
) -> Result<String, Problem> {
    let mut file = File::create(path).await.map_err(|cause| unwritable(&cause))?;
    let (mut hash, mut size_bytes, mut look_at_bytes) = (Sha256::new(), 0_u64, UPLOAD_ROOM_STEP_BYTES);
    let (mut window_ends, mut in_window) = (Instant::now() + UPLOAD_WINDOW, 0_u64);
    loop {
        let chunk = match timeout_at(window_ends, body.next()).await {
            Err(_) if in_window < UPLOAD_WINDOW_MIN_BYTES => return Err(too_slow()),
            Err(_) => {
                (window_ends, in_window) = (Instant::now() + UPLOAD_WINDOW, 0);
                continue;
            }
            Ok(None) => break,
            Ok(Some(chunk)) => chunk.map_err(|cause| {
                Problem::new(ProblemKind::BadRequest, "the upload was cut off").because(cause.to_string())
            })?,
        };
        size_bytes += chunk.len() as u64;
        in_window += chunk.len() as u64;
        if size_bytes > UPLOAD_LIMIT_BYTES {
            return Err(too_large());
        }
        if size_bytes > look_at_bytes {
            room()?;
            look_at_bytes = size_bytes + UPLOAD_ROOM_STEP_BYTES;
        }
        hash.update(&chunk);
        file.write_all(&chunk).await.map_err(|cause| unwritable(&cause))?;
    }
    file.flush().await.map_err(|cause| unwritable(&cause))?;
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

fn too_slow() -> Problem {
    let detail = format!("less than {UPLOAD_WINDOW_MIN_BYTES} bytes arrived within {} s", UPLOAD_WINDOW.as_secs());
    Problem::new(ProblemKind::TimedOut, detail).remedy("send it again over a faster connection")
}

fn unwritable(cause: &std::io::Error) -> Problem {
    let kind = match cause.kind() {
        std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => ProblemKind::StorageFull,
        _ => ProblemKind::Internal,
    };
    Problem::new(kind, "the upload cannot be written")
        .because(cause.to_string())
        .remedy("delete captures or scans that are no longer needed")
}

/// Returns a capture.
#[utoipa::path(
    get, path = "/captures/{id}", tag = "captures", params(("id" = String, Path)),
    responses((status = 200, body = CaptureDto))
)]
async fn get_capture(State(app): State<App>, ApiPath(id): ApiPath<String>) -> Result<Json<CaptureDto>, Problem> {
    Ok(Json(app.catalogue.read().capture(&id).await?.try_into()?))
}

/// Downloads the archive as it was uploaded.
#[utoipa::path(
    get, path = "/captures/{id}/archive", tag = "captures", params(("id" = String, Path)),
    responses((status = 200, content((Vec<u8> = "application/zip"), (Vec<u8> = "application/x-tar"))))
)]
async fn download_capture(State(app): State<App>, ApiPath(id): ApiPath<String>) -> Result<Response, Problem> {
    let record = app.catalogue.read().capture(&id).await?;
    let (media, ending) =
        if record.archive_format == "zip" { ("application/zip", "zip") } else { ("application/x-tar", "tar") };
    artifact(
        &app,
        &record.archive,
        &format!("the archive of capture {id}"),
        media,
        Some(&format!("{id}.{ending}")),
    )
    .await
}

/// Deletes a capture.
#[utoipa::path(
    delete, path = "/captures/{id}", tag = "captures", params(("id" = String, Path)),
    responses((status = 204, description = "Deleted"))
)]
async fn delete_capture(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
) -> Result<StatusCode, Problem> {
    use_cases::delete_capture(&app, &by, id).await?;
    Ok(StatusCode::NO_CONTENT)
}
