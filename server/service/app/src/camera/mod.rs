//! The camera between jobs: how people set it, kept over restarts, and exposure found from the live view.

pub mod auto_exposure;
pub mod memory;
