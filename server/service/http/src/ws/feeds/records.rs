//! Progress of jobs and the number of the newest event, for one client.

use app::jobs::{JobNews, JobView};
use live::pace::Pace;
use live::protocol::DEFAULT_RATE_HZ;
use live::protocol::text::{ServerText, Subscription};
use serde_json::Value;
use tokio::sync::watch;
use tokio::time::Instant;

use crate::wire::job::jobs::JobDto;
use crate::ws::feeds::{Next, changed, text};
use crate::ws::streams::Streams;

/// Job progress: only the newest of each job counts.
pub struct JobsFeed {
    jobs: watch::Receiver<JobNews>,
    pace: Pace,
    /// Number of the last progress message sent.
    sent: u64,
}

impl JobsFeed {
    /// A new subscription; the current progress of running jobs comes first.
    pub fn new(wanted: &Subscription, streams: &Streams) -> Self {
        let pace = Pace::new(wanted.max_rate_hz.unwrap_or(DEFAULT_RATE_HZ), Instant::now());
        Self { jobs: streams.sources.jobs.clone(), pace, sent: 0 }
    }

    /// The oldest unsent progress.
    pub fn next(&mut self, now: Instant) -> Next {
        let news = self.jobs.borrow_and_update();
        let Some((number, view)) = news.after(self.sent) else { return Next::Nothing };
        if now < self.pace.opens() {
            return Next::At(self.pace.opens());
        }
        self.pace.pass(now);
        self.sent = number;
        text(&ServerText::Job { job: &job_json(view) })
    }

    /// Waits for something newer.
    pub async fn changed(&mut self) {
        changed(&mut self.jobs).await;
    }
}

/// The number of the newest event.
pub struct EventsFeed {
    events: watch::Receiver<i64>,
    sent: Option<i64>,
}

impl EventsFeed {
    /// A new subscription.
    pub fn new(streams: &Streams) -> Self {
        Self { events: streams.sources.events.clone(), sent: None }
    }

    /// The newest number, unless it was sent already.
    pub fn next(&mut self) -> Next {
        let seq = *self.events.borrow_and_update();
        if self.sent.replace(seq) == Some(seq) {
            return Next::Nothing;
        }
        text(&ServerText::Event { seq })
    }

    /// Waits for something newer.
    pub async fn changed(&mut self) {
        changed(&mut self.events).await;
    }
}

/// A job as `GET /api/v1/jobs/{id}` returns it.
fn job_json(view: &JobView) -> Value {
    serde_json::to_value(JobDto::from(view.clone())).unwrap_or_default()
}
