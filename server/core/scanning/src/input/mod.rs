//! The input of a scan: its frames, with the stage position of each.

pub mod exposures;
pub mod frames;
pub mod line_step;
pub mod line_widths;
pub mod motions;
pub mod stage_positions;
pub mod synthetic;
