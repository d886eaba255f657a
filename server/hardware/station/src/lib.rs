//! The station: one thread owns the hardware, everyone else sends it commands through a bounded channel.
//!
//! [`StationHandle`] is what the rest of the service holds. A job takes a [`StationLease`] and drives the station
//! through calls that read like an operator's procedure; people's single commands go through
//! [`StationHandle::manual`] and are refused while a job has the station. [`StationHandle::stop`] is always taken.

//! What lives here: the station thread, its state machine, faults, Stop, the leases of light and motion, the buffers of
//! frames. What may not: jobs, HTTP, async beyond channels, configuration files.

pub mod cancel;
pub mod config;
pub mod frame;
pub mod handle;
pub mod lease;
pub mod recycling;
pub mod refusal;
pub mod status;

mod acquisition;
mod command;
mod devices;
mod exposures;
mod faults;
mod light;
mod live_view;
mod machine;
mod mirror;
mod motion;
mod obeying;
mod outlook;
mod owner;
pub mod params;
mod pool;
mod reset;
mod run;
mod stamping;
mod stop_line;
mod stopping;
mod task;
mod thread;
mod track;
mod viewers;
pub mod wall_clock;

pub use frame::{SharedFrame, StampedFrame};
pub use handle::{LiveRequest, Manual, Purpose, StationHandle, Sweep};
pub use lease::StationLease;
pub use outlook::first_status;
pub use refusal::StationRefusal;
pub use status::{DeviceStatus, Fault, LaserLight, MachineState, OperationalState, StateHistory, StationStatus};
pub use stop_line::StopEpoch;

#[cfg(test)]
mod tests;
