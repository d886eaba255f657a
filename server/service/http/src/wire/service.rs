//! Whether the service lives and can work.

use serde::Serialize;
use utoipa::ToSchema;

/// The process answers.
#[derive(Debug, Serialize, ToSchema)]
pub struct HealthDto {
    /// `alive`.
    #[schema(example = "alive")]
    pub status: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// Whether users and TLS are left to a reverse proxy before this server (`http.trusted_proxy`).
    pub trusted_proxy: bool,
}

/// Jobs can run.
#[derive(Debug, Serialize, ToSchema)]
pub struct ReadyDto {
    /// `ready`.
    #[schema(example = "ready")]
    pub status: &'static str,
    /// State of the station in words; a station in error does not keep captures from being computed.
    pub station: String,
    /// Room on the disk of the data folder.
    pub free_bytes: Option<u64>,
}
