//! `[[doors.webhook]]`.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::params::TIMEOUT_S;

/// `[[doors.webhook]]`: a web server that receives signed events.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// unique name of the door: lower-case letters, digits, - and _
    #[schemars(regex(pattern = "^[a-z0-9_-]+$"))]
    pub name: String,
    /// address that events are posted to, such as `https://mes.example/hooks`; `http://` only within allowed_private
    pub url: String,
    /// file with the secret that signs events, whsec_ and base64 of 24 to 64 bytes; during a rotation one per line
    pub secret_file: PathBuf,
    /// file with the certificates (PEM) that the receiver's must lead to; without: those of public authorities
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ca_file: Option<PathBuf>,
    /// events to deliver: kinds, beginnings such as inspection.*, or * for all
    #[serde(default = "default_events")]
    pub events: Vec<String>,
    /// recipes whose inspections are delivered; empty: all
    #[serde(default)]
    pub recipes: Vec<String>,
    /// addresses that may be reached although they are not public: single ones or ranges such as 10.1.0.0/16
    #[serde(default)]
    pub allowed_private: Vec<String>,
    /// time for an attempt, s
    #[serde(default = "default_timeout_s")]
    #[schemars(range(min = 1, max = 60))]
    pub timeout_s: u64,
}

fn default_events() -> Vec<String> {
    vec!["inspection.finished".to_owned()]
}

fn default_timeout_s() -> u64 {
    TIMEOUT_S
}
