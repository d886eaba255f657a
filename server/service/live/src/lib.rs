//! Live data: frames with their centrelines and profiles, and the points of a running scan.
//!
//! Viewers may lose frames: an image or profile that was not read in time is replaced by the next one. The points of a
//! scan are a sequence without gaps, kept until the next scan starts. [`protocol`] is the wire format of `sheaf.v1`.
//!
//! Not in this crate: sockets, HTTP, jobs.

pub mod bus;
pub mod interest;
pub mod jpeg;
pub mod pace;
pub mod points;
pub mod protocol;
pub mod view;
pub mod worker;

pub use bus::{LiveBus, LiveFrame};
pub use interest::{Demand, StreamKind};
pub use points::{PointLog, PointsSeen};
pub use protocol::points::DisplayPoint;
