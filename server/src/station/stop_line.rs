//! The line a stop travels on: beside the commands, never behind them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use tokio::sync::oneshot;

use crate::station::refusal::StationRefusal;

/// Someone who asked for a stop and waits until the devices were told.
pub struct StopRequest {
    /// Who.
    pub actor: String,
    /// Told once motion and light were ended.
    pub done: oneshot::Sender<Result<(), StationRefusal>>,
}

/// Stops that wait for the station thread. Bounded by the number of connections the server takes.
#[derive(Default)]
pub struct StopLine {
    pulled: AtomicBool,
    requests: Mutex<Vec<StopRequest>>,
}

impl StopLine {
    /// Asks for a stop.
    pub fn pull(&self, request: StopRequest) {
        self.requests.lock().unwrap_or_else(PoisonError::into_inner).push(request);
        self.pulled.store(true, Ordering::SeqCst);
    }

    /// Whether a stop waits.
    pub fn is_pulled(&self) -> bool {
        self.pulled.load(Ordering::SeqCst)
    }

    /// All that wait, for the station thread.
    pub fn take(&self) -> Vec<StopRequest> {
        let mut requests = self.requests.lock().unwrap_or_else(PoisonError::into_inner);
        self.pulled.store(false, Ordering::SeqCst);
        std::mem::take(&mut requests)
    }
}
