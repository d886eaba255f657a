//! Driver of controllers with GRBL 1.1, grblHAL or FluidNC on a serial port: one axis is the stage, the spindle output the
//! laser.
//!
//! One `controller` with one thread is shared by [`GrblStage`] and [`GrblLaser`]. The dialogue, its sources and the
//! table of faults are in `server/docs/devices/grbl.md`.

mod dialect;
mod driver;
mod fault;
mod identity;
mod meanings;
pub mod protocol;
mod session;
#[cfg(test)]
mod tests;

pub use dialect::Dialect;
pub use driver::{GrblDriver, GrblSettings};
pub use meanings::{alarm_meaning, error_meaning};

use std::time::Duration;

use crate::drivers::controller::{ControllerLaser, ControllerStage};
use crate::lines::ports::line_to;
use crate::lines::serial_controller::Controller;
use crate::lines::serial_line::SerialLine;
use crate::params::GRBL_MOVING_QUERY_HZ;
use crate::{StageError, StageKind};
use session::Session;

/// One axis of a GRBL controller, see `ControllerStage`. A stop is feed hold and jog cancel at once, and a soft reset as
/// soon as it rests, which is left out where there was nothing but a jog: the position is kept and the laser dark. Homing
/// is reset at once.
pub type GrblStage = ControllerStage<Session>;

/// The spindle output of a GRBL controller in laser mode, see `ControllerLaser`.
pub type GrblLaser = ControllerLaser<Session>;

/// An axis of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// X.
    X,
    /// Y.
    Y,
    /// Z.
    Z,
}

impl Axis {
    pub(crate) fn idx(self) -> usize {
        match self {
            Axis::X => 0,
            Axis::Y => 1,
            Axis::Z => 2,
        }
    }

    pub(crate) fn letter(self) -> char {
        ['X', 'Y', 'Z'][self.idx()]
    }
}

/// How the laser is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LaserMode {
    /// `M3`: constant power, at rest too. What a scan needs.
    Constant,
    /// `M4`: power follows speed; dark at rest.
    Dynamic,
}

/// What is known of the controller; checked against what it says when it is opened.
#[derive(Debug, Clone, PartialEq)]
pub struct GrblConfig {
    /// Device file of the serial port; one of `/dev/serial/by-id` names the same board every time.
    pub port: String,
    /// Symbols per second; 115200 for GRBL, without effect on native USB.
    pub baud_rate: u32,
    /// Which axis is the stage.
    pub axis: Axis,
    /// Linear or rotary; millimetres are degrees then.
    pub kind: StageKind,
    /// What `$100`–`$102` must say.
    pub steps_per_mm: f64,
    /// Positions the stage may go to, mm, by the stage's own scale.
    pub travel_mm: (f64, f64),
    /// Machine position of the stage's zero, mm. GRBL homes to the upper end of a negative machine space. Without
    /// homing switches it has no effect: the stage's zero is where it is homed by hand.
    pub zero_at_machine_mm: f64,
    /// Whether the stage's scale runs against the machine's.
    pub reversed: bool,
    /// Fastest move, mm/s; the controller's own limit holds if it is lower.
    pub max_speed_mm_s: f64,
    /// Longest homing.
    pub homing_limit: Duration,
    /// A text that must stand, as whole words, in a line of the answer to `$I`, so that no other board is taken for
    /// this: the name that `$I=text` writes, or the board's own.
    pub expected_name: Option<String>,
    /// How the laser is driven.
    pub laser_mode: LaserMode,
    /// Status queries during a motion, Hz.
    pub moving_query_hz: f64,
    /// Longest opening: a board that restarts with its port takes two seconds.
    pub open_limit: Duration,
}

impl GrblConfig {
    /// A stage on the X axis of the controller at `port`, with usual values for all the rest.
    pub fn new(port: &str, steps_per_mm: f64, travel_mm: (f64, f64)) -> Self {
        Self {
            port: port.to_owned(),
            baud_rate: 115_200,
            axis: Axis::X,
            kind: StageKind::Linear,
            steps_per_mm,
            travel_mm,
            zero_at_machine_mm: 0.0,
            reversed: false,
            max_speed_mm_s: f64::INFINITY,
            homing_limit: Duration::from_secs(60),
            expected_name: None,
            laser_mode: LaserMode::Constant,
            moving_query_hz: GRBL_MOVING_QUERY_HZ,
            open_limit: Duration::from_secs(5),
        }
    }
}

/// Opens the controller: dark, at rest, checked; the stage is not homed.
///
/// Takes as long as the board needs to restart, at most [`GrblConfig::open_limit`]; unlike every later call.
///
/// # Errors
/// [`StageError::Gone`] without a port, [`StageError::NoReply`] from a silent one, [`StageError::WrongDevice`] if
/// identity, units, steps, travel or laser mode are not as configured.
pub fn open(config: &GrblConfig) -> Result<(GrblStage, GrblLaser), StageError> {
    open_line(config, line_to(&config.port, config.baud_rate))
}

/// As [`open`], over any line.
///
/// # Errors
/// As [`open`].
pub fn open_line(config: &GrblConfig, line: Box<dyn SerialLine>) -> Result<(GrblStage, GrblLaser), StageError> {
    let session = Session::new(config.clone(), line.place());
    let controller = Controller::open("grbl", session, line, config.open_limit)?;
    Ok((GrblStage::new(&controller), GrblLaser::new(&controller)))
}
