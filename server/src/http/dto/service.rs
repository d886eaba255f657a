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
