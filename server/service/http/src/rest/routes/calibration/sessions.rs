//! Calibration sessions: interactive calibration, image by image.

use crate::Http;
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{Reply, artifact, header_text};
use crate::rest::control::By;
use crate::rest::conversions::{accepted, label};
use crate::rest::etag::Versioned;
use crate::rest::extract::{ApiJson, ApiPath, ApiQuery};
use crate::rest::idempotency::{Begun, at_most_once, begin};
use crate::wire::calibration::session_bodies::{BoardDetectionDto, ExposuresDto};
use crate::wire::calibration::sessions::{
    CaptureStageViewDto, NewSessionDto, SessionDefaultsDto, SessionDto, SolveSessionDto, VirtualBoardDto,
};
use crate::wire::job::jobs::JobDto;
use crate::wire::paging::{ListDto, PageQuery};
use app::App;
use app::hash_hex;
use app::sessions::Session;
use app::use_cases;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_sessions, create_session))
        .routes(routes!(get_session_defaults))
        .routes(routes!(get_session, delete_session))
        .routes(routes!(set_session_exposures))
        .routes(routes!(detect_board))
        .routes(routes!(capture_pose))
        .routes(routes!(delete_pose))
        .routes(routes!(capture_stage_view))
        .routes(routes!(delete_stage_view))
        .routes(routes!(get_session_image))
        .routes(routes!(solve_session))
        .routes(routes!(place_board))
}

fn session_href(id: &str) -> String {
    format!("/api/v1/calibration-sessions/{id}")
}

fn versioned(session: Session) -> Versioned<Json<SessionDto>> {
    Versioned(session.version.to_string(), Json(session.into()))
}

fn changed(session: Session) -> Reply {
    Reply::done(Some(session.version.to_string()), &SessionDto::from(session))
}

/// The version in `If-Match`, if present: a number in quotes.
fn expected(headers: &HeaderMap) -> Result<Option<i64>, Problem> {
    let Some(text) = header_text(headers, &header::IF_MATCH)? else { return Ok(None) };
    if text.trim() == "*" {
        return Ok(None);
    }
    text.trim().trim_matches('"').parse().map(Some).map_err(|_| {
        Problem::new(ProblemKind::Changed, format!("{text} is not a version of a session"))
            .remedy("read the session and send its ETag as If-Match")
    })
}

/// Lists calibration sessions, newest first.
#[utoipa::path(
    get, path = "/calibration-sessions", tag = "calibration sessions", params(PageQuery),
    responses((status = 200, body = ListDto<SessionDto>))
)]
async fn list_sessions(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<PageQuery>,
) -> Result<Json<ListDto<SessionDto>>, Problem> {
    let page = query.page()?;
    let sessions = app.sessions.list(&page).await?;
    Ok(Json(ListDto::new("/api/v1/calibration-sessions", &page, sessions, SessionDto::from)))
}

/// Creates a calibration session. It is stored on the server and can be continued from any browser.
#[utoipa::path(
    post, path = "/calibration-sessions", tag = "calibration sessions", request_body = NewSessionDto,
    responses((status = 201, body = SessionDto))
)]
async fn create_session(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<NewSessionDto>,
) -> Result<Reply, Problem> {
    if let Some(name) = &body.value.name {
        label(name, "/name")?;
    }
    let once = match begin(&app, &headers, "POST calibration-sessions", &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let made = |session: &Session| Reply::created(session_href(&session.id), &SessionDto::from(session.clone()));
    let session =
        use_cases::create_session(&app, &by, body.value.into(), |session| once.changes(&made(session))).await?;
    Ok(made(&session))
}

/// Returns the defaults of a new session: the configured board and projector, and the exposures of the newest session.
#[utoipa::path(
    get, path = "/calibration-sessions/defaults", tag = "calibration sessions",
    responses((status = 200, body = SessionDefaultsDto))
)]
async fn get_session_defaults(State(app): State<App>) -> Result<Json<SessionDefaultsDto>, Problem> {
    Ok(Json(app.sessions.defaults().await?.into()))
}

/// Returns a session with all its images and detections.
#[utoipa::path(
    get, path = "/calibration-sessions/{id}", tag = "calibration sessions", params(("id" = String, Path)),
    responses((status = 200, body = SessionDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn get_session(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
) -> Result<Versioned<Json<SessionDto>>, Problem> {
    Ok(versioned(app.sessions.get(&id).await?))
}

/// Deletes a session; calibrations computed from it are kept.
#[utoipa::path(
    delete, path = "/calibration-sessions/{id}", tag = "calibration sessions", params(("id" = String, Path)),
    responses((status = 204, description = "Deleted"))
)]
async fn delete_session(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
) -> Result<StatusCode, Problem> {
    use_cases::delete_session(&app, &by, &id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Changes the exposure settings of a session, for the images to come.
#[utoipa::path(
    put, path = "/calibration-sessions/{id}/exposures", tag = "calibration sessions", request_body = ExposuresDto,
    params(
        ("id" = String, Path),
        ("If-Match" = Option<String>, Header, description = "ETag of the session")
    ),
    responses((status = 200, body = SessionDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn set_session_exposures(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<ExposuresDto>,
) -> Result<Versioned<Json<SessionDto>>, Problem> {
    let expected = expected(&headers)?;
    Ok(versioned(use_cases::set_session_exposures(&app, &by, &id, body.value.into(), expected).await?))
}

/// Detects the board in the current frame without storing anything: what an image captured now would show.
///
/// Uses the newest frame of a running live view; otherwise the camera captures one frame with its current settings.
#[utoipa::path(
    post, path = "/calibration-sessions/{id}/detect-board", tag = "calibration sessions", params(("id" = String, Path)),
    responses((status = 200, body = BoardDetectionDto))
)]
async fn detect_board(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
) -> Result<Json<BoardDetectionDto>, Problem> {
    Ok(Json(app.sessions.detect_board(&id).await?.into()))
}

/// Captures the board as held now, with the laser off and with the laser on, and returns the detections.
#[utoipa::path(
    post, path = "/calibration-sessions/{id}/poses", tag = "calibration sessions", params(
        ("id" = String, Path),
        ("Sheaf-Control" = String, Header, description = "Id of the control lease"),
        ("If-Match" = Option<String>, Header, description = "ETag of the session")
    ),
    responses((status = 200, body = SessionDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn capture_pose(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
    headers: HeaderMap,
) -> Result<Reply, Problem> {
    let route = format!("POST calibration-sessions/{id}/poses");
    at_most_once(&app, &headers, &route, &hash_hex(&[]), async {
        Ok(changed(use_cases::capture_pose(&app, &by, &id, expected(&headers)?).await?))
    })
    .await
}

/// Deletes a pose.
#[utoipa::path(
    delete, path = "/calibration-sessions/{id}/poses/{pose_id}", tag = "calibration sessions",
    params(
        ("id" = String, Path), ("pose_id" = String, Path),
        ("If-Match" = Option<String>, Header, description = "ETag of the session")
    ),
    responses((status = 200, body = SessionDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn delete_pose(
    State(app): State<App>,
    ApiPath((id, pose_id)): ApiPath<(String, String)>,
    By(by): By,
    headers: HeaderMap,
) -> Result<Versioned<Json<SessionDto>>, Problem> {
    Ok(versioned(use_cases::delete_pose(&app, &by, (&id, &pose_id), expected(&headers)?).await?))
}

/// Moves the stage to a position and captures the board on it.
#[utoipa::path(
    post, path = "/calibration-sessions/{id}/stage-views", tag = "calibration sessions",
    request_body = CaptureStageViewDto,
    params(
        ("id" = String, Path),
        ("Sheaf-Control" = String, Header, description = "Id of the control lease"),
        ("If-Match" = Option<String>, Header, description = "ETag of the session")
    ),
    responses((status = 200, body = SessionDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn capture_stage_view(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<CaptureStageViewDto>,
) -> Result<Reply, Problem> {
    let route = format!("POST calibration-sessions/{id}/stage-views");
    at_most_once(&app, &headers, &route, &body.sha256, async {
        let expected = expected(&headers)?;
        let position = body.value.try_into()?;
        Ok(changed(use_cases::capture_stage_view(&app, &by, &id, position, expected).await?))
    })
    .await
}

/// Deletes a stage view.
#[utoipa::path(
    delete, path = "/calibration-sessions/{id}/stage-views/{view_id}", tag = "calibration sessions",
    params(
        ("id" = String, Path), ("view_id" = String, Path),
        ("If-Match" = Option<String>, Header, description = "ETag of the session")
    ),
    responses((status = 200, body = SessionDto, headers(("ETag" = String, description = "Its version"))))
)]
async fn delete_stage_view(
    State(app): State<App>,
    ApiPath((id, view_id)): ApiPath<(String, String)>,
    By(by): By,
    headers: HeaderMap,
) -> Result<Versioned<Json<SessionDto>>, Problem> {
    Ok(versioned(use_cases::delete_stage_view(&app, &by, (&id, &view_id), expected(&headers)?).await?))
}

/// Returns an image of a session, by the artifact id from the session.
#[utoipa::path(
    get, path = "/calibration-sessions/{id}/images/{artifact}", tag = "calibration sessions",
    params(("id" = String, Path), ("artifact" = String, Path)),
    responses((status = 200, body = Vec<u8>, content_type = "image/png"))
)]
async fn get_session_image(
    State(app): State<App>,
    ApiPath((id, image)): ApiPath<(String, String)>,
) -> Result<Response, Problem> {
    let session = app.sessions.get(&id).await?;
    let poses = session.body.poses.iter();
    let of_poses = poses.flat_map(|pose| {
        let laser = pose.laser.as_ref();
        let of_laser = [laser.map(|laser| &laser.image), laser.and_then(|laser| laser.background.as_ref())];
        std::iter::once(&pose.board.image).chain(of_laser.into_iter().flatten())
    });
    let of_views = session.body.stage_views.iter().map(|view| &view.board.image);
    let named = of_poses.chain(of_views).find(|known| known.artifact == image);
    let artifact_id = named.and_then(|known| store::ArtifactId::parse(&known.artifact)).ok_or_else(|| {
        Problem::new(ProblemKind::NotFound, format!("the session has no image {image}"))
            .remedy("use an id from the session")
    })?;
    Ok(artifact(&app, &artifact_id, &format!("an image of session {id}"), "image/png", None)
        .await?
        .into_response())
}

/// Starts the calibration job from the session's usable images.
#[utoipa::path(
    post, path = "/calibration-sessions/{id}/solve", tag = "calibration sessions", params(("id" = String, Path)),
    request_body = SolveSessionDto,
    responses((status = 202, body = JobDto, headers(("Location" = String, description = "Address of the job"))))
)]
async fn solve_session(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<SolveSessionDto>,
) -> Result<Reply, Problem> {
    let route = format!("POST calibration-sessions/{id}/solve");
    let once = match begin(&app, &headers, &route, &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let how = body.value.into();
    let record = use_cases::solve_session(&app, &by, &id, how, |record| once.changes(&accepted(record))).await?;
    Ok(accepted(&record))
}

/// Sets where the virtual operator of the simulated station holds the board.
#[utoipa::path(
    put, path = "/simulation/board", tag = "simulation", request_body = VirtualBoardDto,
    responses((status = 204, description = "Placed"))
)]
async fn place_board(State(app): State<App>, body: ApiJson<VirtualBoardDto>) -> Result<StatusCode, Problem> {
    use_cases::place_board(&app, body.value.into())?;
    Ok(StatusCode::NO_CONTENT)
}
