//! The drivers: one module per kind of device, and their common parts.

pub mod always_on;
pub mod controller;
pub mod conveyor;
pub mod foreign_lines;
pub mod grbl;
pub mod laser_checks;
pub mod marlin;
pub mod progress;
pub mod replay;
pub mod stage_checks;
pub mod threaded;
pub mod zaber;
