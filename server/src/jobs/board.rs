//! Where a running job is: written by its thread, read by everyone.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use store::{Change, JobRecord, JobState};

use crate::jobs::JobView;
use crate::jobs::remaining::Remaining;
use crate::progress::Step;

/// The progress of one running job.
pub(super) struct Board {
    began: Instant,
    state: Mutex<State>,
}

struct State {
    record: JobRecord,
    step: Option<Step>,
    remaining: Remaining,
    unpublished: bool,
    unstored: bool,
}

impl Board {
    /// For a job that begins now.
    pub fn new(record: JobRecord) -> Self {
        let state =
            State { record, step: None, remaining: Remaining::default(), unpublished: true, unstored: false };
        Self { began: Instant::now(), state: Mutex::new(state) }
    }

    /// The job's own report; progress never goes back.
    pub fn report(&self, fraction: f64, step: Step, message: &str) {
        let elapsed_s = self.began.elapsed().as_secs_f64();
        let mut state = self.state();
        if fraction.is_finite() {
            state.record.progress = state.record.progress.max(fraction.clamp(0.0, 1.0));
        }
        state.step = Some(step);
        if state.record.message != message {
            message.clone_into(&mut state.record.message);
        }
        let fraction = state.record.progress;
        state.remaining.learn(fraction, elapsed_s);
        (state.unpublished, state.unstored) = (true, true);
    }

    /// The job began, or ended, as stored.
    pub fn change(&self, change: impl FnOnce(&mut JobRecord)) {
        let mut state = self.state();
        change(&mut state.record);
        state.unpublished = true;
    }

    /// The job as it is now.
    pub fn view(&self) -> JobView {
        let state = self.state();
        let running = state.record.state == JobState::Running;
        let remaining_s = if running { state.remaining.left_s(self.began.elapsed().as_secs_f64()) } else { None };
        JobView { record: state.record.clone(), step: state.step.filter(|_| running), remaining_s }
    }

    /// The job as it is now, if anything was reported since this was asked last.
    pub fn news(&self) -> Option<JobView> {
        let news = std::mem::take(&mut self.state().unpublished);
        news.then(|| self.view())
    }

    /// The change that stores where the job is, if that is not stored yet.
    pub fn checkpoint(&self) -> Option<Change> {
        let mut state = self.state();
        let unstored = std::mem::take(&mut state.unstored);
        (unstored && state.record.state == JobState::Running).then(|| Change::CheckpointJob {
            id: state.record.id.clone(),
            progress: state.record.progress,
            message: state.record.message.clone(),
            checkpoint: state.record.checkpoint.clone(),
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
