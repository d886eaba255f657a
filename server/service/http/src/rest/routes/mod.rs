//! The routes: one file per resource. A handler parses, calls, responds.

pub mod calibration;
pub mod captures;
pub mod doors;
pub mod events;
pub mod hardware;
pub mod inspection;
pub mod jobs;
pub mod measurement_plan;
pub mod measurements;
pub mod profiles;
pub mod recordings;
pub mod scans;
pub mod service;

use crate::Http;
use utoipa_axum::router::OpenApiRouter;

/// Everything under `/api/v1`.
pub fn api() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .merge(hardware::station::routes())
        .merge(hardware::control::routes())
        .merge(hardware::devices::routes())
        .merge(hardware::dark_frame::routes())
        .merge(hardware::features::routes())
        .merge(hardware::simulation::routes())
        .merge(captures::routes())
        .merge(recordings::routes())
        .merge(calibration::calibrations::routes())
        .merge(calibration::sessions::routes())
        .merge(scans::routes())
        .merge(profiles::routes())
        .merge(measurements::routes())
        .merge(measurement_plan::routes())
        .merge(inspection::recipes::routes())
        .merge(inspection::models::routes())
        .merge(inspection::inspections::routes())
        .merge(inspection::evaluation::routes())
        .merge(inspection::statistics::routes())
        .merge(inspection::studies::routes())
        .merge(doors::routes())
        .merge(jobs::routes())
        .merge(events::routes())
}
