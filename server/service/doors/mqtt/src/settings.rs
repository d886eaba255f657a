//! The settings of the door: each doc comment is the description of a setting.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[doors.mqtt]]`: a broker that receives events.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// name of the door, unique
    pub name: String,
    /// the broker, such as mqtt://broker.example or mqtts://broker.example:8883
    #[schemars(regex(pattern = "^mqtts?://"))]
    pub url: String,
    /// beginning of all topics, such as sheaf or plant/hall3
    #[serde(default = "default_prefix")]
    pub prefix: String,
    /// name of this station in topics and in the client id, unique among the clients of the broker
    #[serde(default = "default_station")]
    pub station: String,
    /// user name at the broker
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub username: Option<String>,
    /// file with the password of that user
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub password_file: Option<PathBuf>,
    /// file with the certificates (PEM) that the broker's certificate must lead to; without: those of the system
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ca_file: Option<PathBuf>,
    /// group of Sparkplug B in which the station is an edge node, instead of the topics state and health; without: none
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sparkplug_group: Option<String>,
    /// whether clients of the broker may start and abort inspections and stop the station, on the topic cmd
    #[serde(default)]
    pub commands: bool,
    /// kinds of events, such as inspection.finished, inspection.* or *
    #[serde(default = "default_events")]
    pub events: Vec<String>,
    /// recipes whose inspections are published, and that commands may use; all if empty
    #[serde(default)]
    pub recipes: Vec<String>,
}

fn default_prefix() -> String {
    "sheaf".to_owned()
}

fn default_station() -> String {
    "station".to_owned()
}

fn default_events() -> Vec<String> {
    vec!["inspection.finished".to_owned()]
}
