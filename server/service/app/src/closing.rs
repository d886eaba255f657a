//! The wish to end the service, seen by everything that would otherwise go on for ever.

use tokio::sync::watch;

/// Becomes true once and stays so.
#[derive(Debug, Clone)]
pub struct Closing(watch::Sender<bool>);

impl Default for Closing {
    fn default() -> Self {
        Self(watch::Sender::new(false))
    }
}

impl Closing {
    /// Says that the service ends.
    pub fn close(&self) {
        self.0.send_replace(true);
    }

    /// Whether it ends.
    pub fn is_closing(&self) -> bool {
        *self.0.borrow()
    }

    /// Returns once it ends.
    pub async fn closed(&self) {
        // The sender lives in `self`, so that waiting cannot fail.
        let _ = self.0.subscribe().wait_for(|closing| *closing).await;
    }
}
