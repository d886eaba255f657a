//! Driver of controllers with GRBL 1.1, grblHAL or FluidNC on a serial port: one axis is the stage, the spindle output
//! the laser.
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

/// One axis of a GRBL controller, see `ControllerStage`. A stop sends feed hold and jog cancel at once, and a soft
/// reset as soon as the axis is at rest, which is omitted after a jog: the position is kept and the laser is off.
/// Homing is reset at once.
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
    /// `M4`: power follows speed; off at rest.
    Dynamic,
}

/// Configuration of the controller, which is checked against its own settings when it is opened.
#[derive(Debug, Clone, PartialEq)]
pub struct GrblConfig {
    /// Device file of the serial port; a path in `/dev/serial/by-id` always names the same board.
    pub port: String,
    /// Baud rate; 115200 for GRBL, without effect on native USB.
    pub baud_rate: u32,
    /// Which axis is the stage.
    pub axis: Axis,
    /// Linear or rotary; for rotary stages millimetres are degrees.
    pub kind: StageKind,
    /// Expected value of `$100`–`$102`.
    pub steps_per_mm: f64,
    /// Range of positions, mm, on the stage's own scale.
    pub travel_mm: (f64, f64),
    /// Machine position of the stage's zero, mm. GRBL homes to the upper end of a negative machine space. Without
    /// homing switches it has no effect: the stage's zero is where it is homed manually.
    pub zero_at_machine_mm: f64,
    /// Whether the stage's scale is reversed relative to the machine's.
    pub reversed: bool,
    /// Fastest move, mm/s; the controller's own limit applies if it is lower.
    pub max_speed_mm_s: f64,
    /// Longest homing.
    pub homing_limit: Duration,
    /// A text that must be contained, as whole words, in a line of the answer to `$I`, so that no other board is taken
    /// for this one: the name written by `$I=text`, or the board's own.
    pub expected_name: Option<String>,
    /// How the laser is driven.
    pub laser_mode: LaserMode,
    /// Status queries during a motion, Hz.
    pub moving_query_hz: f64,
    /// Longest opening: a board that restarts with its port takes two seconds.
    pub open_limit: Duration,
}

impl GrblConfig {
    /// A stage on the X axis of the controller at `port`, with default values for the rest.
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

/// Opens the controller: laser off, at rest, checked; the stage is not homed.
///
/// Takes as long as the board needs to restart, at most [`GrblConfig::open_limit`], unlike all later calls.
///
/// # Errors
/// [`StageError::Disconnected`] without a port, [`StageError::NoResponse`] from a silent one, [`StageError::WrongDevice`] if
/// identity, units, steps, travel or laser mode are not as configured.
pub fn open(config: &GrblConfig) -> Result<(GrblStage, GrblLaser), StageError> {
    open_line(config, line_to(&config.port, config.baud_rate))
}

/// As [`open`], over a given line.
///
/// # Errors
/// As [`open`].
pub fn open_line(config: &GrblConfig, line: Box<dyn SerialLine>) -> Result<(GrblStage, GrblLaser), StageError> {
    let session = Session::new(config.clone(), line.port_name());
    let controller = Controller::open("grbl", session, line, config.open_limit)?;
    Ok((GrblStage::new(&controller), GrblLaser::new(&controller)))
}
