//! The open connections: how many there may be, and which one makes room for a new one.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use parking_lot::Mutex;
use tokio::sync::Notify;

use crate::server::params::REPLACEABLE;

/// The open connections.
pub struct Connections {
    limit: usize,
    open: Mutex<Open>,
}

#[derive(Default)]
struct Open {
    next_id: u64,
    by_id: HashMap<u64, Connection>,
}

struct Connection {
    /// Time of the last request.
    active: Instant,
    replaced: Arc<Notify>,
}

/// A place among the connections, until it is dropped.
pub struct Place {
    id: u64,
    connections: Arc<Connections>,
    replaced: Arc<Notify>,
}

impl Connections {
    /// At most `limit`.
    pub fn new(limit: usize) -> Arc<Self> {
        Arc::new(Self { limit, open: Mutex::default() })
    }

    /// A place for a new connection, if there is room; else in place of the one that is silent longest, as with a PLC that
    /// lost its connection without closing it. `None`: all are in use.
    pub fn place(self: &Arc<Self>, now: Instant) -> Option<Place> {
        let mut open = self.open.lock();
        if open.by_id.len() >= self.limit {
            let (id, active) = open.by_id.iter().map(|(id, one)| (*id, one.active)).min_by_key(|one| one.1)?;
            if now.duration_since(active) < REPLACEABLE {
                return None;
            }
            open.by_id.remove(&id)?.replaced.notify_one();
        }
        let (id, replaced) = (open.next_id, Arc::new(Notify::new()));
        open.next_id += 1;
        open.by_id.insert(id, Connection { active: now, replaced: replaced.clone() });
        Some(Place { id, connections: self.clone(), replaced })
    }
}

impl Place {
    /// A request has arrived.
    pub fn note_request(&self, now: Instant) {
        if let Some(connection) = self.connections.open.lock().by_id.get_mut(&self.id) {
            connection.active = now;
        }
    }

    /// Waits until the place is given to another connection.
    pub async fn replaced(&self) {
        self.replaced.notified().await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.connections.open.lock().by_id.remove(&self.id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_connection_that_is_silent_longest_makes_room_and_one_in_use_does_not() {
        let connections = Connections::new(2);
        let begun = Instant::now();
        let polling = connections.place(begun).unwrap();
        let silent = connections.place(begun).unwrap();
        assert!(connections.place(begun).is_none());
        let later = begun + REPLACEABLE;
        polling.note_request(later);
        let third = connections.place(later).unwrap();
        assert!(connections.open.lock().by_id.contains_key(&polling.id));
        drop(silent);
        assert!(connections.place(later).is_none(), "its place was already taken");
        drop(third);
        assert!(connections.place(later).is_some());
    }
}
