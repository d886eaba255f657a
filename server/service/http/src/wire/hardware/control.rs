//! The control lease on the wire.

use std::time::Instant;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use app::lease::Lease;

/// Who wants to command.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TakeControlDto {
    /// Shown to the others.
    #[schema(min_length = 1, max_length = 100, example = "Anna")]
    pub holder: String,
    /// Take it from whoever has it; that is an event.
    #[serde(default)]
    pub take_over: bool,
}

/// Who commands.
#[derive(Debug, Serialize, ToSchema)]
pub struct ControlDto {
    /// Who.
    pub holder: String,
    /// Time left unless it is renewed.
    pub ends_in_s: f64,
}

/// The lease, for its holder alone.
#[derive(Debug, Serialize, ToSchema)]
pub struct ControlLeaseDto {
    /// Send it as `Sheaf-Control` with every command.
    pub id: String,
    /// Who.
    pub holder: String,
    /// Renew it before.
    pub ends_in_s: f64,
}

impl From<&Lease> for ControlDto {
    fn from(lease: &Lease) -> Self {
        Self { holder: lease.holder.clone(), ends_in_s: left_s(lease) }
    }
}

impl From<&Lease> for ControlLeaseDto {
    fn from(lease: &Lease) -> Self {
        Self { id: lease.id.clone(), holder: lease.holder.clone(), ends_in_s: left_s(lease) }
    }
}

fn left_s(lease: &Lease) -> f64 {
    lease.ends_at.saturating_duration_since(Instant::now()).as_secs_f64()
}
