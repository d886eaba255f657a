//! Who asks, who is in control, and a request that is asked twice.

pub mod idempotency;
pub mod lease;
pub mod principal;
