//! The station: one thread owns the hardware, everyone else sends it commands through a bounded channel.
//!
//! [`StationHandle`] is what the rest of the service holds. A job takes a [`StationLease`] and drives the station
//! through calls that read like an operator's procedure; people's single commands go through
//! [`StationHandle::manual`] and are refused while a job has the station. [`StationHandle::stop`] is always taken.

//! What lives here: the station thread, its state machine, faults, Stop, the leases of light and motion, the buffers of
//! frames. What may not: jobs, HTTP, async beyond channels, configuration files.

mod parts;
mod shared;
mod station_thread;
pub use shared::{cancel, frame, recycling, refusal, status, wall_clock};
pub use station_thread::{handle, lease};
pub mod params;

pub use parts::devices::StationDevices;
pub use shared::frame::{SharedFrame, StampedFrame};
pub use shared::refusal::StationRefusal;
pub use shared::status::{
    DeviceStatus, Fault, LaserLight, Lost, MachineState, OperationalState, StateHistory, StationStatus,
};
pub use shared::stop_line::StopEpoch;
pub use shared::tap::{FrameTap, TappedFrame};
pub use station_thread::handle::{LiveRequest, Manual, Purpose, StationHandle, Sweep};
pub use station_thread::lease::StationLease;
pub use station_thread::status_publisher::first_status;

#[cfg(test)]
mod tests;
