//! Tests of recordings through the public interface.

#![allow(clippy::unwrap_used, missing_docs)]

mod broken;
mod common;
mod descriptors;
mod exported;
mod round_trip;
mod witness;
