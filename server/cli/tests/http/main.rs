//! The REST interface against the real binary: what every client may rely on, whatever it does.

#![allow(clippy::unwrap_used, missing_docs)]

#[path = "../common/mod.rs"]
mod common;

mod calibrating;
mod configuration;
mod deleting;
mod document;
mod edge;
mod events;
mod idempotency;
mod lists;
mod page;
mod problems;
mod replay;
mod station;
mod stopping;
mod untyped;
mod verdicts;

use common::server::Server;
use tempfile::TempDir;

/// A server on a fresh data folder.
fn fresh() -> (TempDir, Server) {
    let folder = TempDir::new().unwrap();
    let server = Server::start(&folder.path().join("data"), &[]);
    (folder, server)
}
