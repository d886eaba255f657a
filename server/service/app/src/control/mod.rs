//! Who may use the station: the table of who waits and who is refused, and Stop, which is always allowed.

mod admission;
mod station_use;
mod stop;

pub use admission::admit;
pub use station_use::{Decision, Refusal, Request, StationUse, rule};
pub use stop::{StopOutcome, reset, stop, was_halted};
