//! Chapters of reports, one per module.

pub mod camera;
pub mod correlation;
pub mod dark_frame;
pub mod light;
pub mod measurement;
pub mod stage;
pub mod turntable;
