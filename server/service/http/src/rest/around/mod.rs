//! Middleware for every request and response.

pub mod guard;
pub mod headers;
pub mod heavy;
pub mod metering;
pub mod objects_only;
