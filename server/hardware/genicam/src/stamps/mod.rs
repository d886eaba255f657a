//! Frame ids and exposure times from the camera's counter and clock.

pub mod block_ids;
pub mod clock;
