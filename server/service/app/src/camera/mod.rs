//! The camera between jobs: user settings kept across restarts, and auto-exposure from the live view.

pub mod auto_exposure;
pub mod memory;
