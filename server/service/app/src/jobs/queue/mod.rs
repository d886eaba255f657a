//! The two lanes and the threads that run their jobs.

mod forecast;
pub(in crate::jobs) mod hold;
mod job_progress;
pub(in crate::jobs) mod lane;
pub(in crate::jobs) mod news;
pub(in crate::jobs) mod params;
mod remaining;
pub(in crate::jobs) mod run;
pub(in crate::jobs) mod runner;

use parking_lot::{Mutex, MutexGuard};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Weak};

use station::wall_clock::now_ms;
use tokio::runtime::Handle;
use tokio::sync::{Notify, watch};

use crate::error::AppError;
use crate::jobs::queue::hold::{InspectionHold, is_inspection};
use crate::jobs::queue::lane::{Lane, Running, Waiting};
use crate::jobs::queue::params::SHUT_DOWN_LIMIT;
use crate::jobs::queue::run::Procedure;
use crate::jobs::queue::runner::End;
use crate::jobs::{JobNews, JobParts, JobView};

/// The lane of station jobs.
const STATION: usize = 0;

/// The lane of computations.
const COMPUTATION: usize = 1;

/// The lanes and what jobs work with.
pub(in crate::jobs) struct Queue {
    this: Weak<Queue>,
    pub parts: JobParts,
    pub procedure: Procedure,
    pub runtime: Handle,
    pub progress: watch::Sender<JobNews>,
    /// Held while jobs are added or removed from outside, so that queue and catalogue agree.
    pub turn: tokio::sync::Mutex<()>,
    lanes: Mutex<[Lane; 2]>,
    /// Jobs whose end could not be stored: reported until the restart, which marks them interrupted.
    unsaved: Mutex<Vec<Running>>,
    /// While there is one, no inspection starts.
    pub hold: Mutex<Option<InspectionHold>>,
    closing: AtomicBool,
    idle: Notify,
}

impl Queue {
    pub fn new(parts: JobParts, procedure: Procedure) -> Arc<Self> {
        Arc::new_cyclic(|this| Self {
            this: this.clone(),
            parts,
            procedure,
            runtime: Handle::current(),
            progress: watch::Sender::new(JobNews::default()),
            turn: tokio::sync::Mutex::default(),
            lanes: Mutex::default(),
            unsaved: Mutex::default(),
            hold: Mutex::default(),
            closing: AtomicBool::new(false),
            idle: Notify::new(),
        })
    }

    pub fn this(&self) -> Arc<Self> {
        self.this.upgrade().expect("a method runs while the queue lives")
    }

    /// Enqueues a job; returns it if the station was stopped since it was authorised.
    pub fn push(&self, waiting: Waiting) -> Result<(), Box<Waiting>> {
        let lane_idx = lane_of(&waiting);
        let mut lanes = self.lanes();
        // Under the lock that empties the lane after a Stop: the job is either refused here or removed there.
        if lane_idx == STATION && waiting.authority.epoch != self.parts.station.stop_epoch() {
            return Err(Box::new(waiting));
        }
        lanes[lane_idx].waiting.push_back(waiting);
        Ok(())
    }

    /// After the stop was latched: removes all jobs waiting for the station and cancels the running one. Does not
    /// block.
    pub fn clear_station(&self) -> Vec<Waiting> {
        let mut lanes = self.lanes();
        let lane = &mut lanes[STATION];
        if let Some(running) = &lane.running {
            running.cancel.cancel();
        }
        std::mem::take(&mut lane.waiting).into()
    }

    /// Whether control permits the first job of the station lane to start.
    fn may_begin(&self, waiting: &Waiting) -> bool {
        let in_control = self.parts.control.present(std::time::Instant::now()).map(|lease| lease.holder);
        waiting.authority.may_begin(in_control.as_deref())
    }

    /// Starts no further jobs.
    pub fn close(&self) {
        self.closing.store(true, Ordering::SeqCst);
        for lane in self.lanes().iter_mut() {
            lane.closed = true;
        }
    }

    /// Starts every job that can start.
    pub fn advance(&self) {
        for lane_idx in [STATION, COMPUTATION] {
            let may_begin = |waiting: &Waiting| lane_idx != STATION || self.may_begin(waiting);
            let is_held = self.hold.lock().is_some();
            let passes = |waiting: &Waiting| !(is_held && is_inspection(waiting));
            let Some((waiting, running)) = self.lanes()[lane_idx].next(passes, may_begin) else { continue };
            let queue = self.this();
            let thread = std::thread::Builder::new().name(format!("job-{}", waiting.input.kind()));
            let spawned = thread.spawn(move || {
                queue.live(waiting, &running);
                queue.lanes()[lane_idx].running = None;
                queue.idle.notify_waiters();
                queue.advance();
            });
            if let Err(error) = spawned {
                tracing::error!(%error, "no thread for a job; the next start marks it as interrupted");
                self.lanes()[lane_idx].running = None;
            }
        }
    }

    /// Ends a waiting job; no effect if it is not waiting.
    pub async fn cancel_waiting(&self, id: &str, end: &End, actor: &str) -> Result<(), AppError> {
        let taken = self.lanes().iter_mut().enumerate().find_map(|(idx, lane)| Some((idx, lane.take(id)?)));
        let Some((lane_idx, (place, waiting))) = taken else { return Ok(()) };
        let changes = end.changes(&waiting.record, Some(actor), now_ms());
        if let Err(error) = self.parts.catalogue.commit(changes).await {
            self.lanes()[lane_idx].put_back(place, waiting);
            self.advance();
            return Err(error.into());
        }
        let mut record = waiting.record;
        record.state = end.state();
        self.publish(record.into());
        Ok(())
    }

    pub fn cancel_running(&self, which: impl Fn(&Running) -> bool) {
        for running in
            self.lanes().iter().filter_map(|lane| lane.running.as_ref()).filter(|running| which(running))
        {
            running.cancel.cancel();
        }
    }

    /// Whether the job waits for the station or has it.
    pub fn is_station_job(&self, id: &str) -> bool {
        let lanes = self.lanes();
        let lane = &lanes[STATION];
        lane.waiting.iter().any(|waiting| waiting.record.id == id)
            || lane.running.as_ref().is_some_and(|running| running.id == id)
    }

    pub fn n_waiting(&self) -> usize {
        self.lanes().iter().map(|lane| lane.waiting.len()).sum()
    }

    /// The running jobs, and those whose end could not be stored.
    pub fn running_views(&self) -> Vec<JobView> {
        let mut running: Vec<Running> = self.lanes().iter().filter_map(|lane| lane.running.clone()).collect();
        running.extend_from_slice(&self.unsaved.lock());
        running.iter().map(|running| running.progress.view()).collect()
    }

    pub fn remember_unsaved(&self, running: &Running) {
        self.unsaved.lock().push(running.clone());
    }

    /// Publishes the progress of a job. Late progress of a job whose end was published is dropped.
    pub fn publish(&self, view: JobView) {
        self.progress.send_if_modified(|news| news.publish(view));
    }

    pub fn is_closing(&self) -> bool {
        self.closing.load(Ordering::SeqCst)
    }

    pub async fn shut_down(&self) {
        self.close();
        self.cancel_running(|_| true);
        let all_ended = async {
            loop {
                let mut idle = std::pin::pin!(self.idle.notified());
                idle.as_mut().enable();
                if self.lanes().iter().all(|lane| lane.running.is_none()) {
                    return;
                }
                idle.await;
            }
        };
        if tokio::time::timeout(SHUT_DOWN_LIMIT, all_ended).await.is_err() {
            tracing::warn!("a job did not end in time; the next start marks it as interrupted");
        }
    }

    fn lanes(&self) -> MutexGuard<'_, [Lane; 2]> {
        self.lanes.lock()
    }
}

fn lane_of(waiting: &Waiting) -> usize {
    if waiting.input.needs_station() { STATION } else { COMPUTATION }
}
