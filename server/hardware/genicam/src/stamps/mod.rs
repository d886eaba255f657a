//! What tells frames apart, and when they were exposed: the camera's numbers and its clock.

pub mod block_ids;
pub mod clock;
