//! Idempotency keys of the requests in progress: one key is one request, carried out once.

use parking_lot::Mutex;
use std::collections::HashSet;
use std::sync::Arc;

/// Keys of the requests in progress.
#[derive(Debug, Clone, Default)]
pub struct KeysInFlight(Arc<Mutex<HashSet<String>>>);

/// A key in progress; freed on drop.
#[derive(Debug)]
pub struct InFlight {
    keys: KeysInFlight,
    key: String,
}

impl KeysInFlight {
    /// Registers a key; `None` while a request with the same key is in progress.
    pub fn enter(&self, key: String) -> Option<InFlight> {
        let is_new = self.0.lock().insert(key.clone());
        is_new.then(|| InFlight { keys: self.clone(), key })
    }
}

impl InFlight {
    /// The key.
    pub fn key(&self) -> &str {
        &self.key
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        self.keys.0.lock().remove(&self.key);
    }
}
