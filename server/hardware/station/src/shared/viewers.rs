//! When somebody last watched the camera: live light needs a recent viewer.

use parking_lot::Mutex;
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
        let mut last = self.0.lock();
        *last = (*last).max(at);
    }

    /// When one was there last.
    pub fn last_at(&self) -> Instant {
        *self.0.lock()
    }
}
