//! The control lease: who is in control of the station, until when, and under which authority a job uses it.

mod authority;
mod desk;

pub use authority::Authority;
pub use desk::{Caller, ControlDesk, Lease, nobody};
