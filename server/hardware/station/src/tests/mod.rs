//! Tests of the station with the simulated devices, driven as by jobs and people.

pub mod belt;
pub mod bench;
mod blocked;
mod camera_campaign;
mod dark_frames;
mod defects;
mod exposure_counts;
mod job_calls;
mod latch;
mod manual;
mod matrix;
mod mixed;
mod spy_camera;
mod stops;
