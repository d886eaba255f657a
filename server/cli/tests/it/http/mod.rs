//! The REST interface of the real binary: guarantees for all clients.

mod calibrating;
mod configuration;
mod deleting;
mod doors;
mod inspections;
mod page;
mod projectors;
mod protocol;
mod recordings;
mod replay;
mod station;
mod stopping;
mod targets;
mod verdicts;

use crate::common::server::Server;
use tempfile::TempDir;

/// A server on a fresh data folder.
fn fresh() -> (TempDir, Server) {
    let folder = TempDir::new().unwrap();
    let server = Server::start(&folder.path().join("data"), &[]);
    (folder, server)
}
