//! Whether the store may still write.

use tokio::sync::watch;

use crate::error::StoreError;

/// A latch: after a failed write, its reason stands until the process ends. A failed fsync is never retried,
/// because the kernel may have dropped the pages and report success the second time.
#[derive(Debug)]
pub struct Health {
    failure: watch::Sender<Option<String>>,
}

impl Default for Health {
    fn default() -> Self {
        Self { failure: watch::Sender::new(None) }
    }
}

impl Health {
    /// Fails if a write failed before.
    pub fn check(&self) -> Result<(), StoreError> {
        match self.failure.borrow().clone() {
            Some(reason) => Err(StoreError::ReadOnly { reason }),
            None => Ok(()),
        }
    }

    /// Whether a write failed before.
    pub fn is_read_only(&self) -> bool {
        self.failure.borrow().is_some()
    }

    /// Latches; the first reason stays.
    pub fn fail(&self, reason: String) -> StoreError {
        tracing::error!(%reason, "a write failed; the store is read-only from now on");
        self.failure.send_if_modified(|failure| {
            let first = failure.is_none();
            failure.get_or_insert_with(|| reason.clone());
            first
        });
        StoreError::ReadOnly { reason }
    }

    /// A receiver that gets the reason of the first failed write.
    pub fn watch(&self) -> watch::Receiver<Option<String>> {
        self.failure.subscribe()
    }
}
