//! The settings of the door: each doc comment is the description of a setting.

use std::net::SocketAddr;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[doors.opcua]]`: an OPC UA server after OPC 40100-1 Machine Vision.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// name of the door
    pub name: String,
    /// address and port of the OPC UA server, such as 0.0.0.0:4840
    pub listen: SocketAddr,
    /// name or address that clients reach this computer by; by default the address of listen, or the name of this
    /// computer
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub host: Option<String>,
    /// folder with certificates: the server's own (created if missing), and those of clients in trusted and rejected
    pub certificates: PathBuf,
    /// who may log in
    #[serde(default)]
    pub users: Vec<User>,
    /// users may start and abort inspections, halt the station and reset it; otherwise these methods are refused
    #[serde(default)]
    pub commands: bool,
    /// anyone may read without login and encryption; commands stay refused to them
    #[serde(default)]
    pub anonymous: bool,
    /// ids of the recipes whose inspections are delivered and may be started; all if empty
    #[serde(default)]
    pub recipes: Vec<String>,
}

/// Someone who may log in.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct User {
    /// name
    pub name: String,
    /// file with the password
    pub password_file: PathBuf,
}
