//! The camera between jobs: user settings and dark frame kept across restarts, auto-exposure from the live view, and
//! laser-off images.

pub mod auto_exposure;
pub mod background;
pub mod correction;
pub mod dark_frame;
pub mod memory;
