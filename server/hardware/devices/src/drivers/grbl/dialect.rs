//! Differences of the driver between GRBL 1.1h, grblHAL and FluidNC; documented in
//! `server/docs/devices/grbl.md`.

use std::time::Duration;

/// The controller's firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Dialect {
    /// GRBL 1.1.
    #[default]
    Grbl,
    /// grblHAL.
    GrblHal,
    /// FluidNC.
    FluidNc,
}

/// `ALARM:11` of grblHAL, with bit 2 of `$22`: only homing unlocks it.
const GRBL_HAL_HOMING_REQUIRED: u32 = 11;
/// `ALARM:14` of FluidNC: not homed since power-on or since a limit was hit.
const FLUID_NC_UNHOMED: u32 = 14;

impl Dialect {
    /// Pause after `ALARM:n` during which nothing else happens, and a reset may be lost.
    pub(super) fn alarm_pause(self) -> Duration {
        match self {
            Dialect::Grbl | Dialect::FluidNc => Duration::from_millis(500),
            Dialect::GrblHal => Duration::from_millis(100),
        }
    }

    /// Whether the firmware resets itself after this alarm and sends its banner; after others it waits for a reset.
    pub(super) fn resets_after(self, code: u32) -> bool {
        self != Dialect::FluidNc && matches!(code, 3 | 6..=9)
    }

    /// Whether the laser is off after this alarm. FluidNC leaves it on unless `off_on_alarm` is set, and a failed probe
    /// (4, 5) leaves it on in every firmware.
    pub(super) fn turns_laser_off(self, code: u32) -> bool {
        self != Dialect::FluidNc && !matches!(code, 4 | 5)
    }

    /// Whether this alarm only requests homing, as after power-on.
    pub(super) fn requires_homing(self, code: u32) -> bool {
        match self {
            Dialect::Grbl => false,
            Dialect::GrblHal => code == GRBL_HAL_HOMING_REQUIRED,
            Dialect::FluidNc => code == FLUID_NC_UNHOMED,
        }
    }
}
