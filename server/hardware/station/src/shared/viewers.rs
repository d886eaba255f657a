//! When somebody last watched the camera: live light needs a recent viewer.

use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// When a viewer was last known to be there. Viewers renew it themselves; nobody counts them.
#[derive(Debug)]
pub struct Viewers(Mutex<Instant>);

impl Default for Viewers {
    fn default() -> Self {
        Self(Mutex::new(Instant::now()))
    }
}

impl Viewers {
    /// A viewer was there at that moment.
    pub fn note(&self, at: Instant) {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *last = (*last).max(at);
    }

    /// When one was there last.
    pub fn last_at(&self) -> Instant {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
