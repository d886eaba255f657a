//! Driver of linear and rotary stages with Zaber's ASCII protocol: one axis of one device on a serial line.
//!
//! The dialogue, its sources and the table of faults are in `server/docs/devices/zaber.md`.

mod driver;
mod meanings;
pub mod protocol;
mod session;
#[cfg(test)]
mod tests;

pub use driver::{ZaberDriver, ZaberSettings};
pub use meanings::{Severity, flag_meaning, reason_meaning};

use std::time::Duration;

use crate::drivers::controller::ControllerStage;
use crate::lines::ports::line_to;
use crate::lines::serial_controller::Controller;
use crate::lines::serial_line::SerialLine;
use crate::params::ZABER_MOVING_QUERY_HZ;
use crate::{StageError, StageKind};
use session::Session;

/// One axis of a Zaber device, see `ControllerStage`. A stop brakes with the device's own ramp, and the device has no
/// queue that could continue; the position is kept.
pub type ZaberStage = ControllerStage<Session>;

/// Configuration of the device, which is checked against its own settings when it is opened.
#[derive(Debug, Clone, PartialEq)]
pub struct ZaberConfig {
    /// Device file of the serial port.
    pub port: String,
    /// Baud rate; 115200 as delivered.
    pub baud_rate: u32,
    /// Number of the device in its chain, 1–99.
    pub address: u8,
    /// Number of the axis, 1–9.
    pub axis: u8,
    /// Linear or rotary.
    pub kind: StageKind,
    /// Travel in one turn of the motor, mm (rotary: degrees): "linear motion per motor rev" of the data sheet.
    pub travel_per_turn_mm: f64,
    /// Full steps in one turn of the motor.
    pub steps_per_turn: f64,
    /// Range of positions, mm, on the stage's own scale.
    pub travel_mm: (f64, f64),
    /// Device position of the stage's zero, mm.
    pub zero_at_device_mm: f64,
    /// Whether the stage's scale is reversed relative to the device's.
    pub reversed: bool,
    /// Fastest move, mm/s; the device's own `maxspeed` applies if it is lower.
    pub max_speed_mm_s: f64,
    /// Expected value of `system.serial`.
    pub expected_serial: Option<u32>,
    /// Longest homing.
    pub homing_limit: Duration,
    /// Position queries during a motion, Hz.
    pub moving_query_hz: f64,
    /// Longest opening.
    pub open_limit: Duration,
}

impl ZaberConfig {
    /// Axis 1 of device 1 at `port`, with default values for the rest.
    pub fn new(port: &str, travel_per_turn_mm: f64, travel_mm: (f64, f64)) -> Self {
        Self {
            port: port.to_owned(),
            baud_rate: 115_200,
            address: 1,
            axis: 1,
            kind: StageKind::Linear,
            travel_per_turn_mm,
            steps_per_turn: 200.0,
            travel_mm,
            zero_at_device_mm: 0.0,
            reversed: false,
            max_speed_mm_s: f64::INFINITY,
            expected_serial: None,
            homing_limit: Duration::from_secs(60),
            moving_query_hz: ZABER_MOVING_QUERY_HZ,
            open_limit: Duration::from_secs(3),
        }
    }
}

/// Opens the device: at rest, checked; the stage is not homed.
///
/// # Errors
/// [`StageError::Disconnected`] without a port, [`StageError::NoResponse`] from a silent one, [`StageError::WrongDevice`] if
/// serial number, axis or travel are not as configured.
pub fn open(config: &ZaberConfig) -> Result<ZaberStage, StageError> {
    open_line(config, line_to(&config.port, config.baud_rate))
}

/// As [`open`], over a given line.
///
/// # Errors
/// As [`open`].
pub fn open_line(config: &ZaberConfig, line: Box<dyn SerialLine>) -> Result<ZaberStage, StageError> {
    let session = Session::new(config.clone(), line.port_name());
    Ok(ZaberStage::new(&Controller::open("zaber", session, line, config.open_limit)?))
}
