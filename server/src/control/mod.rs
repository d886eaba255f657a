//! Who may use the station: the control lease, the one table of who waits and who is refused, and Stop, which passes
//! by both.

mod authority;
mod desk;
mod station_use;
mod stop;

pub use authority::Authority;
pub use desk::{ControlDesk, Lease};
pub use station_use::{Ask, Asker, Refusal, Ruling, StationUse, rule};
pub use stop::{StopOutcome, reset, stop, was_halted};
