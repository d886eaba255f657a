//! Liveness, readiness, metrics and the API document.

use crate::Http;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use station::LaserLight;
use store::JobState;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::bytes;
use crate::rest::openapi::document_json;
use crate::wire::hardware::station::state_label;
use crate::wire::service::{HealthDto, ReadyDto};
use app::App;

/// The routes outside `/api/v1`.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(get_health))
        .routes(routes!(get_readiness))
        .routes(routes!(get_metrics))
        .routes(routes!(get_openapi))
}

/// Liveness: responds while the process runs.
#[utoipa::path(get, path = "/health", tag = "service", responses((status = 200, body = HealthDto)))]
async fn get_health(State(http): State<Http>) -> Json<HealthDto> {
    let trusted_proxy = http.config.trusted_proxy;
    Json(HealthDto { status: "alive", version: env!("CARGO_PKG_VERSION"), trusted_proxy })
}

/// Readiness: whether jobs can run; if not, the problem says why.
#[utoipa::path(get, path = "/ready", tag = "service", responses((status = 200, body = ReadyDto)))]
async fn get_readiness(State(app): State<App>) -> Result<Json<ReadyDto>, Problem> {
    if app.closing.is_cancelled() {
        return Err(Problem::new(ProblemKind::Unavailable, "the service is shutting down").retry_after_s(5));
    }
    if app.store.is_read_only() {
        return Err(Problem::new(ProblemKind::Unavailable, "the store has been read-only since a write failed")
            .remedy("check the disk, then restart"));
    }
    let label = state_label(app.station.status().state);
    Ok(Json(ReadyDto { status: "ready", station: label.to_owned(), free_bytes: app.store.free_bytes().ok() }))
}

/// Returns metrics in Prometheus format.
#[utoipa::path(
    get, path = "/metrics", tag = "service",
    responses((status = 200, body = String, content_type = "text/plain"))
)]
async fn get_metrics(State(http): State<Http>) -> Result<Response, Problem> {
    let app = &http.app;
    update_station_metrics(app);
    update_job_metrics(app).await?;
    metrics::gauge!("sheaf_stream_sockets").set(http.streams.n_sockets() as f64);
    if let Ok(free_bytes) = app.store.free_bytes() {
        metrics::gauge!("sheaf_store_free_bytes").set(free_bytes as f64);
    }
    metrics::gauge!("sheaf_store_read_only").set(f64::from(u8::from(app.store.is_read_only())));
    Ok(bytes("text/plain; version=0.0.4", None, http.figures.render()))
}

fn update_station_metrics(app: &App) {
    let status = app.station.status();
    metrics::counter!("sheaf_frames_arrived_total").absolute(status.frames_arrived);
    for (reason, count) in &status.frames_dropped {
        metrics::counter!("sheaf_frames_dropped_total", "reason" => *reason).absolute(*count);
    }
    let on = matches!(status.laser_light, LaserLight::On | LaserLight::Unknown | LaserLight::NotControlled);
    metrics::gauge!("sheaf_laser_on").set(f64::from(u8::from(on)));
    metrics::gauge!("sheaf_camera_frame_rate_hz").set(status.frame_rate_hz);
    metrics::gauge!("sheaf_station_faults").set(status.faults.len() as f64);
}

async fn update_job_metrics(app: &App) -> Result<(), Problem> {
    for (state, code) in [(JobState::Queued, "queued"), (JobState::Running, "running")] {
        /// More than queue and workers can hold.
        const MANY: u32 = 1_000;
        let jobs = app.catalogue.read().jobs(Some(state), &store::Page { before: None, limit: MANY }).await?;
        metrics::gauge!("sheaf_jobs", "state" => code).set(jobs.records.len() as f64);
    }
    Ok(())
}

/// Returns this document.
#[utoipa::path(
    get, path = "/openapi.json", tag = "service",
    responses((status = 200, body = serde_json::Value))
)]
async fn get_openapi() -> Response {
    static TEXT: std::sync::LazyLock<String> = std::sync::LazyLock::new(document_json);
    bytes("application/json", None, TEXT.as_str())
}
