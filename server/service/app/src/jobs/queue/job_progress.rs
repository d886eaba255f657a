//! Progress of a running job: written by its thread, read by all.

use parking_lot::{Mutex, MutexGuard};
use std::time::Instant;

use serde_json::Value;
use store::{Change, JobRecord, JobState};

use crate::jobs::JobView;
use crate::jobs::progress::Step;
use crate::jobs::queue::forecast::{Forecast, Timeline};
use crate::jobs::queue::remaining::Remaining;

/// Smallest change of the forecast progress that is published: less is not visible on a progress bar.
const PUBLISHED_STEP: f64 = 0.005;

/// The progress of one running job.
pub(in crate::jobs) struct JobProgress {
    began: Instant,
    state: Mutex<State>,
}

struct State {
    record: JobRecord,
    step: Option<Step>,
    /// The fraction reported by the job, and when it was reached, s since the start.
    reached: (f64, f64),
    timeline: Timeline,
    forecast: Option<Forecast>,
    /// Estimate without a forecast.
    remaining: Remaining,
    unpublished: bool,
    published: f64,
    unstored: bool,
}

impl State {
    /// Progress in time, and seconds remaining.
    fn now(&self, elapsed_s: f64) -> (f64, Option<f64>) {
        let (fraction, reached_s) = self.reached;
        let (progress, left_s) = match &self.forecast {
            Some(forecast) => {
                let (share, left_s) = forecast.at(fraction, reached_s, elapsed_s);
                (share, Some(left_s))
            }
            None => (fraction, self.remaining.left_s(elapsed_s)),
        };
        (self.record.progress.max(progress), left_s)
    }
}

impl JobProgress {
    /// For a job that starts now.
    pub fn new(record: JobRecord) -> Self {
        let state = State {
            record,
            step: None,
            reached: (0.0, 0.0),
            timeline: Timeline::default(),
            forecast: None,
            remaining: Remaining::default(),
            unpublished: true,
            published: 0.0,
            unstored: false,
        };
        Self { began: Instant::now(), state: Mutex::new(state) }
    }

    /// Forecast from the last jobs of its kind.
    pub fn set_forecast(&self, forecast: Option<Forecast>) {
        self.state().forecast = forecast;
    }

    /// Records a report of the job; progress never decreases.
    pub fn report(&self, fraction: f64, step: Step, message: &str) {
        let elapsed_s = self.began.elapsed().as_secs_f64();
        let mut state = self.state();
        if fraction.is_finite() && fraction > state.reached.0 {
            let fraction = fraction.min(1.0);
            state.reached = (fraction, elapsed_s);
            state.timeline.note(fraction, elapsed_s);
        }
        state.step = Some(step);
        if state.record.message != message {
            message.clone_into(&mut state.record.message);
        }
        let fraction = state.reached.0;
        state.remaining.learn(fraction, elapsed_s);
        state.record.progress = state.now(elapsed_s).0;
        (state.unpublished, state.unstored) = (true, true);
    }

    /// Records the stored start or end of the job.
    pub fn change(&self, change: impl FnOnce(&mut JobRecord)) {
        let mut state = self.state();
        change(&mut state.record);
        state.unpublished = true;
    }

    /// The current state of the job.
    pub fn view(&self) -> JobView {
        let mut state = self.state();
        if state.record.state != JobState::Running {
            return JobView { record: state.record.clone(), step: None, remaining_s: None };
        }
        let (progress, remaining_s) = state.now(self.began.elapsed().as_secs_f64());
        state.record.progress = progress;
        JobView { record: state.record.clone(), step: state.step, remaining_s }
    }

    /// The current state of the job, if it has changed since the last call.
    pub fn news(&self) -> Option<JobView> {
        let view = self.view();
        let mut state = self.state();
        let moved = view.record.progress - state.published >= PUBLISHED_STEP;
        let news = std::mem::take(&mut state.unpublished) || moved;
        if news {
            state.published = view.record.progress;
        }
        news.then_some(view)
    }

    /// The timeline as stored for forecasts of similar jobs; `size`: amount of work.
    pub fn timeline(&self, size: f64) -> Value {
        let took_s = self.began.elapsed().as_secs_f64();
        self.state().timeline.to_json(took_s, size)
    }

    /// The change that stores the progress, unless it is stored already.
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
        self.state.lock()
    }
}
