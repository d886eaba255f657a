//! Driver of controllers with Marlin on a serial port: one axis is the stage, the cutter output the laser.
//!
//! Marlin has no feed hold and no real-time stop that keeps the position. Moves are therefore sent as short pieces,
//! only a short time ahead: a stop sends no more. The dialogue, its sources, the effect of a stop and the table of
//! faults are in `server/docs/devices/marlin.md`.

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

/// One axis of a Marlin controller, see `ControllerStage`. A stop sends no more pieces, so that it brakes at the end of
/// those sent, and queries until it is at rest; the position is kept. Pieces not finished in time are dropped (`M410`),
/// at the cost of the position. Homing is halted permanently (`M112`).
pub type MarlinStage = ControllerStage<Session>;

/// The cutter output of a Marlin controller built with `LASER_FEATURE`, see `ControllerLaser`.
pub type MarlinLaser = ControllerLaser<Session>;

/// Configuration of the controller, which is checked against its own settings when it is opened.
#[derive(Debug, Clone, PartialEq)]
pub struct MarlinConfig {
    /// Device file of the serial port.
    pub port: String,
    /// Baud rate: 115200 or 250000, as the firmware was built.
    pub baud_rate: u32,
    /// Which axis is the stage.
    pub axis: Axis,
    /// Linear or rotary.
    pub kind: StageKind,
    /// Expected value of `M92`.
    pub steps_per_mm: f64,
    /// Range of positions, mm, on the stage's own scale.
    pub travel_mm: (f64, f64),
    /// Machine position of the stage's zero, mm.
    pub zero_at_machine_mm: f64,
    /// Whether the stage's scale is reversed relative to the machine's.
    pub reversed: bool,
    /// Fastest move, mm/s; `M203` applies if it is lower.
    pub max_speed_mm_s: f64,
    /// A text that must be contained in the answer to `M115`, so that no other board is taken for this one.
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
            expected_name: None,
            full_power: 255.0,
            homing_limit: Duration::from_secs(60),
            moving_query_hz: MARLIN_MOVING_QUERY_HZ,
            open_limit: Duration::from_secs(5),
        }
    }
}

/// Opens the controller: laser off, at rest, checked; the stage is not homed.
///
/// # Errors
/// [`StageError::Disconnected`] without a port, [`StageError::NoResponse`] from a silent one, [`StageError::WrongDevice`] if
/// identity, steps, travel or emergency parser are not as required.
pub fn open(config: &MarlinConfig) -> Result<(MarlinStage, MarlinLaser), StageError> {
    open_line(config, line_to(&config.port, config.baud_rate))
}

/// As [`open`], over a given line.
///
/// # Errors
/// As [`open`].
pub fn open_line(
    config: &MarlinConfig,
    line: Box<dyn SerialLine>,
) -> Result<(MarlinStage, MarlinLaser), StageError> {
    let session = Session::new(config.clone(), line.port_name());
    let controller = Controller::open("marlin", session, line, config.open_limit)?;
    Ok((MarlinStage::new(&controller), MarlinLaser::new(&controller)))
}
