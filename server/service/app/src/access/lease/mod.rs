//! The control lease: who is in control of the station, for how long, and on whose word a job uses it.

mod authority;
mod desk;

pub use authority::Authority;
pub use desk::{Asker, ControlDesk, Lease, nobody};
