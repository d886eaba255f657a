//! Initial estimates: board poses, camera, lit points, sheets.

pub(crate) mod board_lines;
pub mod camera_fit;
pub(crate) mod chaining;
pub(crate) mod first_sheets;
pub(crate) mod homography;
pub(crate) mod zhang;
