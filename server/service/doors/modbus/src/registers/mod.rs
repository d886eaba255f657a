//! The registers: which there are, how values are encoded, and the list in print.

pub mod map;
pub mod print;
pub mod result_block;
pub mod value;
