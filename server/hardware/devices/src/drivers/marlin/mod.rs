//! Driver of controllers with Marlin on a serial port: one axis is the stage, the cutter output the laser.
//!
//! Marlin has no feed hold and no real-time stop that keeps the position. Moves are therefore sent as short pieces, and
//! never more of them than are over soon: a stop sends no more. The dialogue, its sources, what a stop is worth and the
//! table of faults are in `server/docs/devices/marlin.md`.

mod driver;
mod protocol;
mod session;
#[cfg(test)]
mod tests;

pub use driver::{MarlinDriver, MarlinSettings};

use std::time::Duration;

use crate::drivers::controller::{ControllerLaser, ControllerStage};
use crate::drivers::grbl::Axis;
use crate::lines::ports::line_to;
use crate::lines::serial_controller::Controller;
use crate::lines::serial_line::SerialLine;
use crate::params::MARLIN_MOVING_QUERY_HZ;
use crate::{StageError, StageKind};
use session::Session;

/// One axis of a Marlin controller, see `ControllerStage`. A stop sends no more, so that it brakes at the end of what was
/// sent, and asks when it rests; the position is kept. What has not run out in time is dropped (`M410`), at the price of the
/// position. Homing is halted for good (`M112`).
pub type MarlinStage = ControllerStage<Session>;

/// The cutter output of a Marlin controller built with `LASER_FEATURE`, see `ControllerLaser`.
pub type MarlinLaser = ControllerLaser<Session>;

/// What is known of the controller; checked against what it says when it is opened.
#[derive(Debug, Clone, PartialEq)]
pub struct MarlinConfig {
    /// Device file of the serial port.
    pub port: String,
    /// Symbols per second: 115200 or 250000, as the firmware was built.
    pub baud_rate: u32,
    /// Which axis is the stage.
    pub axis: Axis,
    /// Linear or rotary.
    pub kind: StageKind,
    /// What `M92` must say.
    pub steps_per_mm: f64,
    /// Positions the stage may go to, mm, by the stage's own scale.
    pub travel_mm: (f64, f64),
    /// Machine position of the stage's zero, mm.
    pub zero_at_machine_mm: f64,
    /// Whether the stage's scale runs against the machine's.
    pub reversed: bool,
    /// Fastest move, mm/s; `M203` holds if it is lower.
    pub max_speed_mm_s: f64,
    /// A text that must stand in the answer to `M115`, so that no other board is taken for this.
    pub expected_name: Option<String>,
    /// `S` of `M3` at full power.
    pub full_power: f64,
    /// Longest homing.
    pub homing_limit: Duration,
    /// Position queries during a motion, Hz.
    pub moving_query_hz: f64,
    /// Longest opening: a board that restarts with its port takes two seconds.
    pub open_limit: Duration,
}

impl MarlinConfig {
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
            expected_name: None,
            full_power: 255.0,
            homing_limit: Duration::from_secs(60),
            moving_query_hz: MARLIN_MOVING_QUERY_HZ,
            open_limit: Duration::from_secs(5),
        }
    }
}

/// Opens the controller: dark, at rest, checked; the stage is not homed.
///
/// # Errors
/// [`StageError::Gone`] without a port, [`StageError::NoReply`] from a silent one, [`StageError::WrongDevice`] if
/// identity, steps, travel or emergency parser are not as they must be.
pub fn open(config: &MarlinConfig) -> Result<(MarlinStage, MarlinLaser), StageError> {
    open_line(config, line_to(&config.port, config.baud_rate))
}

/// As [`open`], over any line.
///
/// # Errors
/// As [`open`].
pub fn open_line(
    config: &MarlinConfig,
    line: Box<dyn SerialLine>,
) -> Result<(MarlinStage, MarlinLaser), StageError> {
    let session = Session::new(config.clone(), line.place());
    let controller = Controller::open("marlin", session, line, config.open_limit)?;
    Ok((MarlinStage::new(&controller), MarlinLaser::new(&controller)))
}
