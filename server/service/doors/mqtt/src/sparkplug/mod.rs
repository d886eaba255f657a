//! The station as an edge node of Sparkplug B (3.0.0), and each recipe as one of its devices.
//!
//! A birth announces all metrics of the node or of a device, later messages those that changed. `seq` counts the
//! messages of the node from its birth on, `bdSeq` its connections: the death that the broker publishes belongs to the
//! birth with the same number. All of it has QoS 0, as Sparkplug demands: no broker acknowledges it.

mod metrics;
mod node;
mod payload;
mod report;
mod topics;

pub use node::Node;
pub use report::report;
pub use topics::SparkplugTopics;
