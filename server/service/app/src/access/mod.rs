//! Principals, the control lease, and idempotent requests.

pub mod idempotency;
pub mod lease;
pub mod principal;
