//! The drivers: one module a kind of device, and what they share.

pub mod always_on;
pub mod controller;
pub mod grbl;
pub mod laser_checks;
pub mod marlin;
pub mod replay;
pub mod stage_checks;
pub mod threaded;
pub mod zaber;
