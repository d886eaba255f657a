//! Simulated controllers: the common parts, and one module per firmware.

pub mod grbl_simulator;
pub mod marlin_simulator;
pub mod simulator;
pub mod zaber_simulator;
