//! Capture folders, valid and damaged.

#![allow(clippy::unwrap_used)]

mod bad_input;
mod common;
mod real_photographs;
mod schema;
