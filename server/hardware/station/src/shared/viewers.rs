//! Time at which the camera was last watched: live light requires a recent viewer.

use parking_lot::Mutex;
use std::time::Instant;

/// Time of the last known viewer. Viewers renew it themselves; they are not counted.
#[derive(Debug)]
pub struct Viewers(Mutex<Instant>);

impl Default for Viewers {
    fn default() -> Self {
        Self(Mutex::new(Instant::now()))
    }
}

impl Viewers {
    /// Records a viewer at that time.
    pub fn note(&self, at: Instant) {
        let mut last = self.0.lock();
        *last = (*last).max(at);
    }

    /// Time of the last viewer.
    pub fn last_at(&self) -> Instant {
        *self.0.lock()
    }
}
