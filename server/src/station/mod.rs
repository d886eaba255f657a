//! The station: one thread owns the hardware, everyone else sends it commands through a bounded channel.
//!
//! [`StationHandle`] is what the rest of the service holds. A job takes a [`StationLease`] and drives the station
//! through calls that read like an operator's procedure; people's single commands go through
//! [`StationHandle::manual`] and are refused while a job has the station. [`StationHandle::stop`] is always taken.

pub mod frame;
pub mod handle;
pub mod refusal;
pub mod status;

pub use frame::{FrameStream, SharedFrame, StampedFrame};
pub use handle::{LiveRequest, Manual, Purpose, StationHandle, StationLease, Sweep};
pub use refusal::StationRefusal;
pub use status::{
    DeviceStatus, DropCounts, Fault, LaserLight, MachineState, OperationalState, StateHistory, StationStatus,
};
