//! A controller with GRBL, grblHAL or FluidNC, one axis and a laser, simulated in real time behind a pseudo-terminal.
//!
//! For tests of the driver and of the service: it implements the firmware's dialogue, its axis takes time, it fails on
//! request, and its [`EventLog`] records the actual light and motion and the time of each byte. It can outlive the
//! process under test, with its record in a file and its terminal at a known path.

#[cfg(test)]
mod cells;
mod dialect;
mod firmware;
mod motion;

pub use crate::simulators::simulator::{Entry, EventLog, LogEvent};
pub use dialect::Dialect;

use std::time::Duration;

use crate::simulators::simulator::Simulator;
pub use firmware::Firmware;

/// The simulated machine. Positions are on the machine's own scale: 0 at the switch, negative elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatorConfig {
    /// Its start-up line.
    pub banner: String,
    /// Text stored by `$I=`.
    pub name: String,
    /// Its firmware.
    pub dialect: Dialect,
    /// Letter of the axis.
    pub axis: char,
    /// `$100` and so on.
    pub steps_per_mm: f64,
    /// `$110` and so on, mm/s.
    pub max_speed_mm_s: f64,
    /// `$120` and so on.
    pub acceleration_mm_s2: f64,
    /// `$130` and so on.
    pub max_travel_mm: f64,
    /// `$27`.
    pub pull_off_mm: f64,
    /// Speed of homing.
    pub homing_mm_s: f64,
    /// `$30`.
    pub max_spindle: f64,
    /// Delay of `ok` after the spindle word changed, as for a spindle that spins up.
    pub spindle_delay: Duration,
    /// `$32`.
    pub laser_mode: u8,
    /// `$10`.
    pub report_mask: u32,
    /// `$39` of grblHAL.
    pub realtime_in_commands: bool,
    /// Bit 0 of `$22`.
    pub homing: bool,
    /// Bit 2 of `$22` of grblHAL: nothing but homing is allowed before homing.
    pub homing_lock: bool,
    /// Whether homing finds its switch.
    pub switch_works: bool,
    /// `$62` of grblHAL.
    pub sleeps: bool,
    /// `$20`.
    pub soft_limits: bool,
    /// `$13`.
    pub inches: bool,
    /// True position of the axis at power-on.
    pub start_at_mm: f64,
}

impl Default for SimulatorConfig {
    /// [`SimulatorConfig::of`] GRBL 1.1h.
    fn default() -> Self {
        Self::of(Dialect::Grbl)
    }
}

impl SimulatorConfig {
    /// A small stage with switches: 100 mm of travel, 200 mm/s, 5 m/s², homed within tens of milliseconds.
    pub fn of(dialect: Dialect) -> Self {
        Self {
            banner: dialect.banner().to_owned(),
            name: "simulated stage".to_owned(),
            dialect,
            axis: 'X',
            steps_per_mm: 400.0,
            max_speed_mm_s: 200.0,
            acceleration_mm_s2: 5000.0,
            max_travel_mm: 100.0,
            pull_off_mm: 1.0,
            homing_mm_s: 200.0,
            max_spindle: 1000.0,
            spindle_delay: Duration::ZERO,
            laser_mode: 1,
            // Factory defaults.
            report_mask: if dialect == Dialect::GrblHal { 511 } else { 1 },
            realtime_in_commands: true,
            homing: true,
            homing_lock: false,
            switch_works: true,
            sleeps: false,
            soft_limits: true,
            inches: false,
            start_at_mm: -5.0,
        }
    }

    pub(crate) fn axis_idx(&self) -> usize {
        match self.axis {
            'X' => 0,
            'Y' => 1,
            _ => 2,
        }
    }
}

/// Events of this controller in addition to the common ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// It acknowledges no line, but reports, until it is repaired.
    NoAcknowledgement,
    /// The axis is blocked during a move, and the firmware waits for it, until it is repaired.
    Stall,
    /// The emergency stop is pressed, so that no reset has effect, until it is repaired.
    EmergencyStop,
    /// It raises an alarm.
    Alarm(u32),
    /// The laser is on without a request.
    StrayLight,
    /// An override is changed at the machine: a real-time byte that did not come over this line.
    Override(u8),
    /// The door's switch; the stop caused by the door is the byte 0x84.
    DoorOpen(bool),
}

/// See the module.
pub type GrblSimulator = Simulator<Firmware>;
