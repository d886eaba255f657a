//! The path of a Stop, independent of the command channel; and the latch that it sets.
//!
//! The station thread stops its devices. If it is blocked in a driver's call, the guard stops them instead, through the
//! devices' own stop handles; the thread repeats it after the call.

use parking_lot::{Condvar, Mutex, MutexGuard};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use devices::StopHandle;
use tokio::sync::oneshot;

use crate::shared::refusal::StationRefusal;

/// Counts Stops. Work authorised before a Stop has an older epoch than the station and is refused.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct StopEpoch(u64);

/// A request to stop, waiting for the devices' acknowledgement.
pub struct StopRequest {
    /// Who requested it.
    pub actor: String,
    /// Answered once motion and light have ended.
    pub done: oneshot::Sender<Result<(), StationRefusal>>,
}

impl StopRequest {
    /// Answers; the requester may have stopped waiting.
    pub fn answer(self, answer: Result<(), StationRefusal>) {
        drop(self.done.send(answer));
    }
}

/// Pending requests, and the devices that can be stopped independently of the station thread.
#[derive(Default)]
struct Guarded {
    requests: Vec<StopRequest>,
    /// Requests that the station thread is carrying out.
    obeyed: Vec<StopRequest>,
    /// Who requested the first of them.
    actor: String,
    /// It was requested, and the devices have not been stopped since.
    is_due: bool,
    handles: Vec<Arc<dyn StopHandle>>,
    is_closed: bool,
}

/// Pending Stops. Bounded by the number of connections that the server accepts.
#[derive(Default)]
pub struct StopLine {
    pulled: AtomicBool,
    latched: AtomicBool,
    epoch: AtomicU64,
    guarded: Mutex<Guarded>,
    changed: Condvar,
}

impl StopLine {
    /// A stop line, latched or not by an earlier process.
    pub fn latched(latched: bool) -> Self {
        Self { latched: AtomicBool::new(latched), ..Self::default() }
    }

    /// Requests a Stop: from now on nothing authorised before can take the station.
    pub fn pull(&self, request: StopRequest) {
        let mut guarded = self.lock();
        if !guarded.is_due {
            guarded.actor.clone_from(&request.actor);
        }
        guarded.requests.push(request);
        guarded.is_due = true;
        self.epoch.fetch_add(1, Ordering::SeqCst);
        self.latched.store(true, Ordering::SeqCst);
        self.pulled.store(true, Ordering::SeqCst);
        self.changed.notify_all();
    }

    /// Whether a Stop is pending.
    pub fn is_pulled(&self) -> bool {
        self.pulled.load(Ordering::SeqCst)
    }

    /// Whether a Stop was requested since the last reset.
    pub fn is_latched(&self) -> bool {
        self.latched.load(Ordering::SeqCst)
    }

    /// The current epoch.
    pub fn epoch(&self) -> StopEpoch {
        StopEpoch(self.epoch.load(Ordering::SeqCst))
    }

    /// The station thread begins to stop its devices; returns who requested it.
    pub fn begin_stop(&self) -> String {
        let mut guarded = self.lock();
        self.pulled.store(false, Ordering::SeqCst);
        guarded.obeyed = std::mem::take(&mut guarded.requests);
        guarded.actor.clone()
    }

    /// All devices were sent the stop; returns the requests that wait for it.
    pub fn obeyed(&self) -> Vec<StopRequest> {
        let mut guarded = self.lock();
        guarded.is_due = self.is_pulled();
        self.changed.notify_all();
        std::mem::take(&mut guarded.obeyed)
    }

    /// A reset has succeeded: releases the latch, unless a Stop is requested at the same moment.
    pub fn release(&self) {
        let _no_pull_meanwhile = self.lock();
        if !self.is_pulled() {
            self.latched.store(false, Ordering::SeqCst);
        }
    }

    /// Adds a device that can be stopped independently of the station thread.
    pub fn add(&self, handle: Arc<dyn StopHandle>) {
        self.lock().handles.push(handle);
    }

    /// Ends [`StopLine::guard`].
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_all();
    }

    /// Stops the devices if the station thread has not done so within `patience` after a Stop, and answers its
    /// requesters; returns after [`StopLine::close`].
    pub fn guard(&self, patience: Duration) {
        let mut guarded = self.lock();
        while !guarded.is_closed {
            guarded = self.wait_while(guarded, Duration::MAX, |guarded| !guarded.is_due);
            guarded = self.wait_while(guarded, patience, |guarded| guarded.is_due);
            if guarded.is_closed || !guarded.is_due {
                continue;
            }
            let handles = guarded.handles.clone();
            drop(guarded);
            tracing::error!("the station thread is blocked in a driver's call: its devices are stopped directly");
            handles.iter().for_each(|handle| handle.stop_now());
            guarded = self.lock();
            guarded.is_due = false;
            // The Stop stays pending: the thread carries it out after the call.
            let Guarded { requests, obeyed, .. } = &mut *guarded;
            obeyed.drain(..).chain(requests.drain(..)).for_each(|request| request.answer(Ok(())));
        }
    }

    fn wait_while<'a>(
        &self,
        mut guarded: MutexGuard<'a, Guarded>,
        limit: Duration,
        holds: impl Fn(&Guarded) -> bool,
    ) -> MutexGuard<'a, Guarded> {
        let goes_on = |guarded: &mut Guarded| !guarded.is_closed && holds(guarded);
        self.changed.wait_while_for(&mut guarded, goes_on, limit);
        guarded
    }

    fn lock(&self) -> MutexGuard<'_, Guarded> {
        self.guarded.lock()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request() -> StopRequest {
        StopRequest { actor: "a person".to_owned(), done: oneshot::channel().0 }
    }

    #[test]
    fn a_pulled_line_stays_latched_until_it_is_released_and_a_pull_beats_the_release() {
        let line = StopLine::default();
        let before = line.epoch();
        line.pull(request());
        assert!(line.is_pulled() && line.is_latched() && line.epoch() > before);
        line.release();
        assert!(line.is_latched(), "the Stop was not carried out yet");
        assert_eq!(line.begin_stop(), "a person");
        assert_eq!(line.obeyed().len(), 1);
        assert!(line.is_latched(), "carrying it out does not release it");
        line.release();
        assert!(!line.is_latched());
        assert!(line.epoch() > before, "the earlier authorisation stays outdated");
    }
}
