//! The station over the simulated one, driven as jobs and people drive it.

mod account;
pub mod bench;
mod blocked;
mod by_hand;
mod camera_campaign;
mod defects;
mod job_calls;
mod latch;
mod matrix;
mod mixed;
mod spied;
mod stops;
