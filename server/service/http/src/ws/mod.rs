//! The live stream: WebSocket sub-protocol `sheaf.v1`, specified in `openapi/stream.md`.
//!
//! A frame is encoded once for all viewers (`encoder`), each stream keeps only its newest message, and every connection
//! (`connection`) sends what its client has subscribed to as fast as the client reads.

mod alone;
pub mod connection;
pub mod encoder;
pub mod feeds;
pub mod listener;
pub mod meter;
pub mod station;
pub mod streams;
#[cfg(test)]
mod tests;

pub use alone::serve_stream;
pub use streams::{Sources, Streams, stream};
