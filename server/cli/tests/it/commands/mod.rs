//! Single commands: their output, messages and refusals.

pub mod bad_input;
pub mod benches;
pub mod contract;
pub mod hard_photographs;
pub mod lines_of_photographs;
pub mod photographs;
pub mod plans;
pub mod schemas;
pub mod target;
