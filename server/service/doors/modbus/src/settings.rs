//! The settings of the door.

use std::net::SocketAddr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[doors.modbus]]`: results for programmable logic controllers, and triggers from them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// name of the door
    pub name: String,
    /// address and port of the Modbus TCP server, such as 0.0.0.0:502
    pub listen: SocketAddr,
    /// a PLC may write: trigger, abort and stop inspections, and acknowledge results; otherwise every write is refused
    /// with exception 1, and the newest result is shown without acknowledgement
    #[serde(default)]
    pub writes: bool,
    /// ids of the recipes whose inspections are delivered and may be triggered; all if empty
    #[serde(default)]
    pub recipes: Vec<String>,
    /// connections at a time; a further one replaces the one that has been silent longest
    #[serde(default = "max_connections")]
    #[schemars(range(min = 1, max = 64))]
    pub max_connections: usize,
}

fn max_connections() -> usize {
    8
}
