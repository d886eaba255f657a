//! The control lease on the wire.

use std::time::Instant;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use app::lease::Lease;

/// Request to take control.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TakeControlDto {
    /// Name shown to others.
    #[schema(min_length = 1, max_length = 100, example = "Anna")]
    pub holder: String,
    /// Take control from the current holder; logged as an event.
    #[serde(default)]
    pub take_over: bool,
}

/// Who is in control.
#[derive(Debug, Serialize, ToSchema)]
pub struct ControlDto {
    /// Name of the holder.
    pub holder: String,
    /// Seconds until the lease expires unless it is renewed.
    pub expires_in_s: f64,
}

/// The control lease, returned only to its holder.
#[derive(Debug, Serialize, ToSchema)]
pub struct ControlLeaseDto {
    /// Send it in the header `Sheaf-Control` with every command.
    pub id: String,
    /// Name of the holder.
    pub holder: String,
    /// Seconds until the lease expires; renew it earlier.
    pub expires_in_s: f64,
}

impl From<&Lease> for ControlDto {
    fn from(lease: &Lease) -> Self {
        Self { holder: lease.holder.clone(), expires_in_s: left_s(lease) }
    }
}

impl From<&Lease> for ControlLeaseDto {
    fn from(lease: &Lease) -> Self {
        Self { id: lease.id.clone(), holder: lease.holder.clone(), expires_in_s: left_s(lease) }
    }
}

fn left_s(lease: &Lease) -> f64 {
    lease.ends_at.saturating_duration_since(Instant::now()).as_secs_f64()
}
