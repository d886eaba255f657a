//! What handlers of several resources share.

use axum::http::HeaderMap;

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::Reply;
use crate::rest::idempotency::{Begun, begin};
use crate::wire::job::jobs::{JobDto, job_href};
use app::App;
use app::jobs::{JobInput, JobView};
use app::principal::Principal;
use app::use_cases::start_job;
use store::JobRecord;

pub use app::labels::label;

/// Accepts a job, at most once per idempotency key: 202 with its address.
pub async fn accept_job(
    app: &App,
    by: &Principal,
    headers: &HeaderMap,
    route: &str,
    body_sha256: &str,
    input: JobInput,
) -> Result<Reply, Problem> {
    let once = match begin(app, headers, route, body_sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let record = start_job(app, by, input, |record| once.changes(&accepted(record))).await?;
    Ok(accepted(&record))
}

/// The response for an accepted job.
pub fn accepted(record: &JobRecord) -> Reply {
    Reply::accepted(job_href(&record.id), &JobDto::from(JobView::from(record.clone())))
}

/// Runs blocking or CPU-bound work off the async threads.
pub async fn blocking<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, Problem> {
    tokio::task::spawn_blocking(work).await.map_err(|cause| {
        tracing::error!(%cause, "a computation panicked");
        Problem::new(ProblemKind::Internal, "an internal error occurred")
            .remedy("report it together with the server log")
    })
}

/// Checks a number of entries; `place` is the JSON pointer.
pub fn check_count(count: usize, allowed: std::ops::RangeInclusive<usize>, place: &str) -> Result<(), Problem> {
    if allowed.contains(&count) {
        return Ok(());
    }
    let (least, most) = (allowed.start(), allowed.end());
    Err(Problem::new(ProblemKind::Impossible, format!("{count} entries are outside the allowed number"))
        .at(place)
        .remedy(format!("give {least} to {most}")))
}

/// Checks a fraction of full laser power, 0 to 1; `place` is the JSON pointer.
pub fn check_laser_power(power: f64, place: &str) -> Result<(), Problem> {
    if (0.0..=1.0).contains(&power) {
        return Ok(());
    }
    Err(Problem::new(ProblemKind::Impossible, format!("{power} is not a share of full power"))
        .at(place)
        .remedy("give a number from 0 to 1"))
}
