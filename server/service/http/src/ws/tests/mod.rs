//! The stream over real sockets, with invented frames: what clients see, and what becomes of slow and rude ones.
//!
//! Not shown here: real stations, and load; `server/cli/tests/it/service/stream_load.rs` does.

mod bench;
mod manners;
mod points;
mod status;
mod viewing;
