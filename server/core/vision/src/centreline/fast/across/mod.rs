//! The crossings of a trace: straightened, and measured across the line.

pub mod block;
pub mod clearance;
pub mod crossings;
pub mod pieces;
pub mod ridge;
pub mod surroundings;
pub mod taps;
pub mod window;
