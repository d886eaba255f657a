//! Heap of the process: returning memory, counting allocations.

pub mod allocations;
pub mod memory;
