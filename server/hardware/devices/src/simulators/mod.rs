//! Simulated controllers: what they share, and one firmware each.

pub mod grbl_simulator;
pub mod marlin_simulator;
pub mod simulator;
pub mod zaber_simulator;
