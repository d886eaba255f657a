//! Differences of the three firmwares: GRBL 1.1h, grblHAL, FluidNC.
//!
//! Derived from the sources of gnea/grbl (bfb67f0), grblHAL/core (f80fc34) and bdring/FluidNC (e952f33f); the table of
//! states and commands is in `server/docs/devices/grbl.md`.

use std::time::Duration;

/// A firmware with GRBL's protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Dialect {
    /// GRBL 1.1h.
    Grbl,
    /// grblHAL.
    GrblHal,
    /// FluidNC.
    FluidNc,
}

impl Dialect {
    /// All of them.
    pub const ALL: [Dialect; 3] = [Dialect::Grbl, Dialect::GrblHal, Dialect::FluidNc];

    /// Its start-up line.
    pub fn banner(self) -> &'static str {
        match self {
            Dialect::Grbl => "Grbl 1.1h ['$' for help]",
            Dialect::GrblHal => "GrblHAL 1.1f ['$' or '$HELP' for help]",
            Dialect::FluidNc => "Grbl 4.0 [FluidNC v4.0.1 (esp32-wifi) '$' for help]",
        }
    }

    /// Pause after `ALARM:n` during which nothing else happens.
    pub(super) fn alarm_pause(self) -> Duration {
        match self {
            Dialect::Grbl | Dialect::FluidNc => Duration::from_millis(500),
            Dialect::GrblHal => Duration::from_millis(100),
        }
    }

    /// Size of its receive buffer, bytes.
    pub(super) fn rx_bytes(self) -> usize {
        match self {
            Dialect::Grbl => 128,
            Dialect::GrblHal => 1024,
            Dialect::FluidNc => 256,
        }
    }

    /// Size of its planner queue.
    pub(super) fn blocks(self) -> usize {
        match self {
            Dialect::Grbl | Dialect::FluidNc => 15,
            Dialect::GrblHal => 100,
        }
    }
}
