//! Starting and cancelling jobs.

use store::{Change, JobRecord};

use crate::App;
use crate::access::lease::Authority;
use crate::access::principal::Principal;
use crate::control::{Request, admit};
use crate::error::AppError;
use crate::jobs::{JobInput, JobView};

/// Accepts a job durably, together with what `and` returns or not at all.
///
/// Whether a job, such as a scan, may start is decided in this order:
/// 1. here, by [`admit`]: the caller may use the station, which is neither stopped nor faulty (the table
///    [`rule`](crate::control::rule));
/// 2. before it is stored ([`Jobs::submit_with`](crate::jobs::Jobs::submit_with)): what it asks for is possible
///    (`jobs/check.rs`, for a scan with its plan), and queue and disk have room;
/// 3. when its turn has come: whoever is in control now is who it was accepted for, and there was no Stop since.
///
/// # Errors
/// The caller may not use the station, the input is invalid, or queue or disk are full.
pub async fn start_job(
    app: &App,
    by: &Principal,
    input: JobInput,
    and: impl FnOnce(&JobRecord) -> Vec<Change>,
) -> Result<JobRecord, AppError> {
    let authority = match input.needs_station() {
        true => admit(app, by, Request::StartJob)?,
        // A computation needs no authority.
        false => Authority { holder: None, epoch: app.station.stop_epoch() },
    };
    app.jobs.submit_with(input, &by.actor, authority, and).await
}

/// Cancels a job. While someone is in control, only they can cancel a job that needs the station.
///
/// # Errors
/// The job does not exist, or the caller may not use the station.
pub async fn cancel_job(app: &App, by: &Principal, id: &str) -> Result<JobView, AppError> {
    if app.jobs.is_station_job(id) {
        admit(app, by, Request::CancelJob)?;
    }
    app.jobs.cancel(id, &by.actor).await
}
