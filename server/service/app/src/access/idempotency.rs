//! One key is one request, done once: the keys of requests that are being answered.

use parking_lot::Mutex;
use std::collections::HashSet;
use std::sync::Arc;

/// Keys of requests that are being answered.
#[derive(Debug, Clone, Default)]
pub struct KeysInFlight(Arc<Mutex<HashSet<String>>>);

/// A key's place among those in flight; given back when dropped.
#[derive(Debug)]
pub struct InFlight {
    keys: KeysInFlight,
    key: String,
}

impl KeysInFlight {
    /// Enters a key; `None` while the same key is being answered.
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
