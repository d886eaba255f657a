//! The station over the simulated one, driven as jobs and people drive it.

mod bench;
mod by_hand;
mod job_calls;
