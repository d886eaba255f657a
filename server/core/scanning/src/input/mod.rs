//! What a scan is computed from: its frames, and where the stage stood in each.

pub mod exposures;
pub mod frames;
pub mod line_step;
pub mod line_widths;
pub mod motions;
pub mod stage_positions;
pub mod synthetic;
