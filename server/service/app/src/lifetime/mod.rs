//! The service from its start to its end, and what is tidied meanwhile.

pub mod housekeeping;
pub mod start;
