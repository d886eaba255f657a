//! Holds: artifacts that no record refers to yet and that sweeps must not delete.
//!
//! A stored artifact is held until a record refers to it. During a sweep no hold is released: a record that
//! is committed after the sweep has read the catalogue still protects what it refers to.

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
    /// Each hold is for a record not committed yet.
    n_holders: u32,
    newest: Instant,
}

/// A sweep is running; holds released meanwhile end when this is dropped.
#[derive(Debug)]
pub struct Sweeping<'a>(&'a Holds);

impl Holds {
    /// Protects an artifact; holds are counted, and each needs its own release.
    pub fn hold(&self, id: &ArtifactId) {
        let mut table = self.table();
        let hold = table.held.entry(id.clone()).or_insert(Hold { n_holders: 0, newest: Instant::now() });
        (hold.n_holders, hold.newest) = (hold.n_holders + 1, Instant::now());
    }

    /// Releases one hold of each artifact, now that a record refers to it; those not held are ignored.
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

    /// Starts a sweep; one at a time. Expired holds are released.
    pub fn begin_sweep(&self) -> Sweeping<'_> {
        let mut table = self.table();
        table.held.retain(|_, hold| hold.newest.elapsed() < HOLD_LIMIT);
        table.sweeping = true;
        Sweeping(self)
    }

    /// Runs a function on an artifact unless it is held; it cannot be held meanwhile.
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
    fn two_holds_need_two_releases_and_none_ends_during_a_sweep() {
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
