//! The routes: one file per resource. A handler parses, calls, answers.

pub mod calibrations;
pub mod captures;
pub mod control;
pub mod devices;
pub mod events;
pub mod features;
pub mod jobs;
pub mod measurement_plan;
pub mod measurements;
pub mod profiles;
pub mod scans;
pub mod service;
pub mod sessions;
pub mod simulation;
pub mod station;

use crate::Http;
use utoipa_axum::router::OpenApiRouter;

/// Everything under `/api/v1`.
pub fn api() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .merge(station::routes())
        .merge(control::routes())
        .merge(devices::routes())
        .merge(features::routes())
        .merge(simulation::routes())
        .merge(captures::routes())
        .merge(calibrations::routes())
        .merge(sessions::routes())
        .merge(scans::routes())
        .merge(profiles::routes())
        .merge(measurements::routes())
        .merge(measurement_plan::routes())
        .merge(jobs::routes())
        .merge(events::routes())
}
