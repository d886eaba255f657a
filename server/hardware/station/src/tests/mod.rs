//! Tests of the station with the simulated devices, driven as by jobs and people.

mod account;
pub mod belt;
pub mod bench;
mod blocked;
mod by_hand;
mod camera_campaign;
mod dark_frames;
mod defects;
mod job_calls;
mod latch;
mod matrix;
mod mixed;
mod spied;
mod stops;
