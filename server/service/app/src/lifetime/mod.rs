//! Start-up, shutdown and housekeeping of the service.

pub mod housekeeping;
pub mod start;
