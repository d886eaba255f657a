//! The line a Stop travels on: beside the commands, never behind them; and the latch it leaves behind.

use parking_lot::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use tokio::sync::oneshot;

use crate::shared::refusal::StationRefusal;

/// Counts the Stops. What was authorised before a Stop has an older epoch than the station and never takes it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct StopEpoch(u64);

/// A request to stop, waiting for the devices' acknowledgement.
pub struct StopRequest {
    /// Who.
    pub actor: String,
    /// Answered once motion and light have ended.
    pub done: oneshot::Sender<Result<(), StationRefusal>>,
}

/// Stops that wait for the station thread. Bounded by the number of connections the server takes.
#[derive(Default)]
pub struct StopLine {
    pulled: AtomicBool,
    latched: AtomicBool,
    epoch: AtomicU64,
    requests: Mutex<Vec<StopRequest>>,
}

impl StopLine {
    /// A line that an earlier process left latched, or not.
    pub fn latched(latched: bool) -> Self {
        Self { latched: AtomicBool::new(latched), ..Self::default() }
    }

    /// Requests a stop: from here on nothing that was authorised before takes the station.
    pub fn pull(&self, request: StopRequest) {
        let mut requests = self.requests();
        requests.push(request);
        self.epoch.fetch_add(1, Ordering::SeqCst);
        self.latched.store(true, Ordering::SeqCst);
        self.pulled.store(true, Ordering::SeqCst);
    }

    /// Whether a stop waits.
    pub fn is_pulled(&self) -> bool {
        self.pulled.load(Ordering::SeqCst)
    }

    /// Whether it was pulled since the last reset.
    pub fn is_latched(&self) -> bool {
        self.latched.load(Ordering::SeqCst)
    }

    /// The present epoch.
    pub fn epoch(&self) -> StopEpoch {
        StopEpoch(self.epoch.load(Ordering::SeqCst))
    }

    /// All that wait, for the station thread.
    pub fn take(&self) -> Vec<StopRequest> {
        let mut requests = self.requests();
        self.pulled.store(false, Ordering::SeqCst);
        std::mem::take(&mut requests)
    }

    /// A reset has ended well: the latch opens, unless somebody pulls at this moment.
    pub fn release(&self) {
        let _no_pull_meanwhile = self.requests();
        if !self.is_pulled() {
            self.latched.store(false, Ordering::SeqCst);
        }
    }

    fn requests(&self) -> parking_lot::MutexGuard<'_, Vec<StopRequest>> {
        self.requests.lock()
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
        assert!(line.is_latched(), "the pull was not obeyed yet");
        assert_eq!(line.take().len(), 1);
        assert!(line.is_latched(), "obeying is not releasing");
        line.release();
        assert!(!line.is_latched());
        assert!(line.epoch() > before, "what was authorised before stays old");
    }
}
