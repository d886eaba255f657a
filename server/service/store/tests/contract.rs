//! What every catalogue and every artifact store must do, asked through the traits alone.
//!
//! [`stores`] lists the implementations; each test walks it. What a crash does is asked in `kill.rs`.

#![allow(clippy::unwrap_used)]

mod common;

#[path = "contract/artifacts.rs"]
mod artifacts;
#[path = "contract/calibrations.rs"]
mod calibrations;
#[path = "contract/events.rs"]
mod events;
#[path = "contract/jobs.rs"]
mod jobs;
#[path = "contract/lists.rs"]
mod lists;
#[path = "contract/scans.rs"]
mod scans;
#[path = "contract/transactions.rs"]
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
