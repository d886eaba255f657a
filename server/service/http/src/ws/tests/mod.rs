//! The stream over real sockets with synthetic frames: what clients receive, and how slow and misbehaving ones are handled.
//!
//! Not shown here: real stations, and load; `server/cli/tests/it/service/stream_load.rs` does.

mod bench;
mod manners;
mod points;
mod status;
mod viewing;
