//! Stage and laser of a controller on a serial line, written once for all protocols: a protocol adds its state.

mod laser;
mod stage;

pub use laser::{ControllerLaser, LaserDialogue};
pub use stage::{ControllerStage, StageDialogue};
