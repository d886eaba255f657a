//! What every catalogue and every artifact store must do, asked through the traits alone.
//!
//! [`stores`] lists the implementations; each test walks it. What a crash does is asked in `kill.rs`.

mod artifacts;
mod calibrations;
mod doors;
mod events;
mod inspections;
mod jobs;
mod lists;
mod recipes;
mod recordings;
mod scans;
mod transactions;

use store::Store;

/// An implementation, empty; its folder goes with it.
pub struct Fresh {
    /// Open.
    pub store: Store,
    _folder: tempfile::TempDir,
}

/// Every implementation, each empty.
pub async fn stores() -> Vec<Fresh> {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).await.unwrap();
    vec![Fresh { store, _folder: folder }]
}
