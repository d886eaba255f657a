//! Tests of recordings through the public interface.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;
mod damaged;
mod descriptors;
mod exported;
mod other_readers;
mod round_trip;
