//! The camera between jobs: user settings and dark frame kept across restarts, and auto-exposure from the live view.

pub mod auto_exposure;
pub mod correction;
pub mod dark_frame;
pub mod memory;
