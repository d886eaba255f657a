//! Who may use the station: the control lease, the one table of who waits and who is refused, and Stop, which passes
//! by both.

mod admission;
mod station_use;
mod stop;

pub use admission::admit;
pub use station_use::{Ask, Refusal, Ruling, StationUse, rule};
pub use stop::{StopOutcome, reset, stop, was_halted};
