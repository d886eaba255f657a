//! Stage and laser of a controller on a line, written once for every protocol: what a protocol adds is its state.

mod laser;
mod stage;

pub use laser::{ControllerLaser, LaserDialogue};
pub use stage::{ControllerStage, StageDialogue};
