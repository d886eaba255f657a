//! Memory of the process: given back, and counted.

pub mod allocations;
pub mod memory;
