//! What is seen at this moment: frames with their centrelines and profiles, and the points of a running scan.
//!
//! Eyes may lose frames: a picture or profile that nobody took in time is replaced by the next one. The points of a
//! scan are a sequence without gaps, kept until the next scan begins. [`protocol`] is the bytes and texts of `sheaf.v1`.
//!
//! What may not live here: sockets, HTTP, jobs.

pub mod bus;
pub mod interest;
pub mod pace;
pub mod points;
pub mod protocol;
pub mod view;
pub mod worker;

pub use bus::{LiveBus, LiveFrame};
pub use interest::{Demand, StreamKind};
pub use points::{DisplayPoint, PointLog, PointsSeen};
