//! Holds: artifacts that no record refers to yet and that sweeps must not delete.
//!
//! Who stores an artifact holds it until a record names it. While a sweep is under way nothing is let go: a record that
//! is committed after the sweep has read the catalogue still protects what it names.

use parking_lot::{Mutex, MutexGuard};
use std::collections::HashMap;
use std::time::Instant;

use crate::artifacts::ArtifactId;
use crate::params::HOLD_LIMIT;

/// The artifacts that are held, in this process.
#[derive(Debug, Default)]
pub struct Holds(Mutex<Table>);

#[derive(Debug, Default)]
struct Table {
    held: HashMap<ArtifactId, Hold>,
    sweeping: bool,
    released_meanwhile: Vec<ArtifactId>,
}

#[derive(Debug)]
struct Hold {
    /// Each of them is for a record that is still to come.
    n_holders: u32,
    newest: Instant,
}

/// A sweep is under way; what was released meanwhile is let go when this is dropped.
#[derive(Debug)]
pub struct Sweeping<'a>(&'a Holds);

impl Holds {
    /// Protects an artifact until it is released once more than before.
    pub fn hold(&self, id: &ArtifactId) {
        let mut table = self.table();
        let hold = table.held.entry(id.clone()).or_insert(Hold { n_holders: 0, newest: Instant::now() });
        (hold.n_holders, hold.newest) = (hold.n_holders + 1, Instant::now());
    }

    /// A record names these now; those that are not held are none of its business.
    pub fn release(&self, ids: impl IntoIterator<Item = ArtifactId>) {
        let mut table = self.table();
        if table.sweeping {
            table.released_meanwhile.extend(ids);
            return;
        }
        for id in ids {
            table.release(&id);
        }
    }

    /// Begins a sweep; one at a time. What was held for longer than anything takes to be named is let go.
    pub fn begin_sweep(&self) -> Sweeping<'_> {
        let mut table = self.table();
        table.held.retain(|_, hold| hold.newest.elapsed() < HOLD_LIMIT);
        table.sweeping = true;
        Sweeping(self)
    }

    /// Does something to an artifact that nobody holds, and lets nobody hold it meanwhile.
    pub fn unless_held<T>(&self, id: &ArtifactId, act: impl FnOnce() -> T) -> Option<T> {
        let table = self.table();
        (!table.held.contains_key(id)).then(act)
    }

    fn table(&self) -> MutexGuard<'_, Table> {
        self.0.lock()
    }
}

impl Table {
    fn release(&mut self, id: &ArtifactId) {
        let Some(hold) = self.held.get_mut(id) else { return };
        hold.n_holders -= 1;
        if hold.n_holders == 0 {
            self.held.remove(id);
        }
    }
}

impl Drop for Sweeping<'_> {
    fn drop(&mut self) {
        let mut table = self.0.table();
        table.sweeping = false;
        for id in std::mem::take(&mut table.released_meanwhile) {
            table.release(&id);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn two_holders_release_twice_and_nothing_is_let_go_during_a_sweep() {
        let holds = Holds::default();
        let id = ArtifactId::parse(&"a".repeat(64)).unwrap();
        let is_free = || holds.unless_held(&id, || ()).is_some();
        assert!(is_free());
        holds.hold(&id);
        holds.hold(&id);
        holds.release([id.clone()]);
        assert!(!is_free(), "another record is still to come");
        let sweep = holds.begin_sweep();
        holds.release([id.clone()]);
        assert!(!is_free(), "the sweep may have read the catalogue before the record came");
        drop(sweep);
        assert!(is_free());
        holds.release([id.clone()]);
        holds.hold(&id);
        assert!(!is_free(), "a release of what is not held does not count");
    }
}
