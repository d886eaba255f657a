//! The station: one thread owns the hardware; all other threads send it commands through a bounded channel.
//!
//! The rest of the service uses a [`StationHandle`]. A job takes a [`StationLease`] and drives the station through
//! blocking calls. Single commands of a person go through [`StationHandle::manual`] and are refused while a job has the
//! station. [`StationHandle::stop`] is always accepted.
//!
//! This crate contains the station thread, its state machine, faults, Stop, the light and motion leases, and the frame
//! buffers. It contains no jobs, no HTTP, no async beyond channels, and no configuration files.

mod parts;
mod shared;
mod station_thread;
pub use shared::{cancel, frame, recycling, refusal, status, wall_clock};
pub use station_thread::{handle, lease};
pub mod params;

pub use parts::devices::StationDevices;
pub use shared::dark_frame::{AppliedDarkFrame, CameraDarkFrame, CameraName, DarkFrameUse};
pub use shared::frame::{SharedFrame, StampedFrame};
pub use shared::refusal::StationRefusal;
pub use shared::status::{
    DeviceStatus, Fault, LaserLight, Lost, MachineState, OperationalState, StateHistory, StationStatus,
};
pub use shared::stop_latch::StopEpoch;
pub use shared::tap::{FrameTap, TappedFrame};
pub use station_thread::handle::{LiveRequest, Manual, Purpose, StationHandle, Sweep};
pub use station_thread::lease::StationLease;
pub use station_thread::status_publisher::first_status;

#[cfg(test)]
mod tests;
