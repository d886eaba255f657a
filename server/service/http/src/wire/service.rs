//! Liveness and readiness on the wire.

use serde::Serialize;
use utoipa::ToSchema;

/// The process is running.
#[derive(Debug, Serialize, ToSchema)]
pub struct HealthDto {
    /// `alive`.
    #[schema(example = "alive")]
    pub status: &'static str,
    /// Program version.
    pub version: &'static str,
    /// Whether a reverse proxy in front of this server handles users and TLS (`http.trusted_proxy`).
    pub trusted_proxy: bool,
}

/// Jobs can run.
#[derive(Debug, Serialize, ToSchema)]
pub struct ReadyDto {
    /// `ready`.
    #[schema(example = "ready")]
    pub status: &'static str,
    /// State of the station in plain words; captures can be processed even if the station has a fault.
    pub station: String,
    /// Free space on the disk of the data folder.
    pub free_bytes: Option<u64>,
}
