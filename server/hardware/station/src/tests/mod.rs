//! The station over the simulated one, driven as jobs and people drive it.

mod account;
pub mod bench;
mod blocked;
mod by_hand;
mod cell;
mod defects;
mod fault_matrix;
mod fault_matrix_grbl;
mod job_calls;
mod latch;
mod mixed;
mod spied;
mod stops;
