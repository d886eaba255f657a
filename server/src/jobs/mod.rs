//! Jobs: what takes seconds, is asked for once, survives the browser that asked, and ends in a stated way.
//!
//! A job is accepted durably, waits in a queue, runs on a thread of its own, and ends together with what it made in
//! one transaction. Jobs that need the station run one at a time; computations run one at a time beside them.

pub mod context;
pub mod input;
pub mod recompute;
pub mod scan;

pub use context::{Done, JobContext, JobEnd};
pub use input::{
    CalibrateInput, ExportInput, JobInput, RecomputeInput, ScanInput, ScanMode, ScanSource, Source, VerifyInput,
};

use store::{JobRecord, JobState};
use tokio::sync::watch;

use crate::problem::Problem;

/// A job as a client sees it: the record, with the progress of this moment.
#[derive(Debug, Clone)]
pub struct JobView {
    /// As stored, with progress and message of this moment.
    pub record: JobRecord,
    /// Seconds to its end; `None` if it cannot be told.
    pub remaining_s: Option<f64>,
}

/// The queue and its runners.
#[derive(Clone)]
pub struct Jobs {}

impl Jobs {
    /// Accepts a job durably. `source` says who asked.
    ///
    /// # Errors
    /// A problem: `too-many` with a full queue, `storage-full`, `impossible` for an input that cannot work.
    pub async fn submit(&self, _input: JobInput, _source: &str) -> Result<JobRecord, Problem> {
        todo!()
    }

    /// Asks a job to end; works in every state, returns the job as it is then.
    pub async fn cancel(&self, _id: &str, _actor: &str) -> Result<JobView, Problem> {
        todo!()
    }

    /// A job now.
    pub async fn view(&self, _id: &str) -> Result<JobView, Problem> {
        todo!()
    }

    /// Jobs now, newest first.
    pub async fn list(&self, _state: Option<JobState>, _page: &store::Page) -> Result<Vec<JobView>, Problem> {
        todo!()
    }

    /// Changes with every progress of any job; carries the job that moved.
    pub fn watch_progress(&self) -> watch::Receiver<Option<JobView>> {
        todo!()
    }

    /// After Stop: ends the running station job and takes the station jobs that wait out of the queue.
    pub async fn stop_station_jobs(&self, _actor: &str) {
        todo!()
    }
}
