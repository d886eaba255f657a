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
    in_progress: Vec<StopRequest>,
    /// Who requested the first of them.
    actor: String,
    /// It was requested, and the devices have not been stopped since.
    is_due: bool,
    handles: Vec<Arc<dyn StopHandle>>,
    is_closed: bool,
}

/// Pending Stops. Bounded by the number of connections that the server accepts.
#[derive(Default)]
pub struct StopLatch {
    pending: AtomicBool,
    latched: AtomicBool,
    epoch: AtomicU64,
    guarded: Mutex<Guarded>,
    changed: Condvar,
}

impl StopLatch {
    /// A stop latch, set or not by an earlier process.
    pub fn new(latched: bool) -> Self {
        Self { latched: AtomicBool::new(latched), ..Self::default() }
    }

    /// Requests a Stop: from now on nothing authorised before can take the station.
    pub fn request(&self, request: StopRequest) {
        let mut guarded = self.lock();
        if !guarded.is_due {
            guarded.actor.clone_from(&request.actor);
        }
        guarded.requests.push(request);
        guarded.is_due = true;
        self.epoch.fetch_add(1, Ordering::SeqCst);
        self.latched.store(true, Ordering::SeqCst);
        self.pending.store(true, Ordering::SeqCst);
        self.changed.notify_all();
    }

    /// Whether a Stop is pending.
    pub fn is_pending(&self) -> bool {
        self.pending.load(Ordering::SeqCst)
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
        self.pending.store(false, Ordering::SeqCst);
        guarded.in_progress = std::mem::take(&mut guarded.requests);
        guarded.actor.clone()
    }

    /// All devices were sent the stop command; returns the requests that wait for it.
    pub fn finish_stop(&self) -> Vec<StopRequest> {
        let mut guarded = self.lock();
        guarded.is_due = self.is_pending();
        self.changed.notify_all();
        std::mem::take(&mut guarded.in_progress)
    }

    /// A reset has succeeded: releases the latch, unless a Stop is requested at the same moment.
    pub fn release(&self) {
        let _no_request_meanwhile = self.lock();
        if !self.is_pending() {
            self.latched.store(false, Ordering::SeqCst);
        }
    }

    /// Adds a device that can be stopped independently of the station thread.
    pub fn add(&self, handle: Arc<dyn StopHandle>) {
        self.lock().handles.push(handle);
    }

    /// Ends [`StopLatch::guard`].
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_all();
    }

    /// Stops the devices if the station thread has not done so within `delay` after a Stop, and answers its
    /// requesters; returns after [`StopLatch::close`].
    pub fn guard(&self, delay: Duration) {
        let mut guarded = self.lock();
        while !guarded.is_closed {
            guarded = self.wait_while(guarded, Duration::MAX, |guarded| !guarded.is_due);
            guarded = self.wait_while(guarded, delay, |guarded| guarded.is_due);
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
            let Guarded { requests, in_progress, .. } = &mut *guarded;
            in_progress.drain(..).chain(requests.drain(..)).for_each(|request| request.answer(Ok(())));
        }
    }

    fn wait_while<'a>(
        &self,
        mut guarded: MutexGuard<'a, Guarded>,
        limit: Duration,
        holds: impl Fn(&Guarded) -> bool,
    ) -> MutexGuard<'a, Guarded> {
        let keep_waiting = |guarded: &mut Guarded| !guarded.is_closed && holds(guarded);
        self.changed.wait_while_for(&mut guarded, keep_waiting, limit);
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
    fn the_latch_stays_set_until_released_and_a_pending_stop_prevents_the_release() {
        let latch = StopLatch::default();
        let before = latch.epoch();
        latch.request(request());
        assert!(latch.is_pending() && latch.is_latched() && latch.epoch() > before);
        latch.release();
        assert!(latch.is_latched(), "the Stop was not carried out yet");
        assert_eq!(latch.begin_stop(), "a person");
        assert_eq!(latch.finish_stop().len(), 1);
        assert!(latch.is_latched(), "carrying it out does not release it");
        latch.release();
        assert!(!latch.is_latched());
        assert!(latch.epoch() > before, "the earlier authorisation stays outdated");
    }
}
