//! Bindings to the C library aravis, and the only unsafe code of this crate: each of its objects is owned by one Rust
//! value, and each call states the contract that makes it sound.
//!
//! Contracts common to all of them (aravis 0.8, `docs/reference/thread-safety.md`): an object is used by one thread at
//! a time, which `&mut` and the lock around a [`Device`] ensure; a stream's buffers may be pushed and popped while its
//! own thread fills them; returned strings are copied at once, and those documented as owned by the caller are freed.
#![allow(unsafe_code)]

mod buffer;
mod device;
mod error;
mod feature_tree;
mod stream;
mod system;

pub use buffer::{Buffer, BufferStatus, Image};
pub use device::{Device, Number};
pub use error::AravisError;
pub use stream::{Stream, StreamOptions};
pub use system::{Listed, enable_fake, list};
