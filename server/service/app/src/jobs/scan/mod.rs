//! Scans a part (row by row or continuously on the station, or from a capture) and measures it.
//!
//! In every case, centrelines are extracted from each frame and stored as peaks, and the cloud is computed from them by
//! the functions of `sheaf scan`: the same frames give the same bytes.

mod capture_source;
mod counted;
mod images;
mod measuring;
pub mod recompute;
mod result;
mod resume;
mod station_source;
mod taking;
mod timing;
mod watched;
mod work;

use crate::jobs::{ComputeContext, Done, JobEnd, RecordedFrames, ScanInput, StationContext};

pub use measuring::{Measured, measured};
pub use result::{Evaluating, MadeScan, ScanStory, check_camera_of, made_scan, scan_changes};
pub use work::{clear_work, recover, remove_orphans};

/// Progress of a job after its frames. The shares are fixed so that jobs can be compared; their durations are taken from
/// recent jobs.
pub const TAKEN: f64 = 0.5;

/// Progress after the cloud if measurements follow.
const EVALUATED: f64 = 0.9;

/// Progress after the cloud of a scan with this many measurements.
pub fn evaluated_share(n_measurements: usize) -> f64 {
    if n_measurements > 0 { EVALUATED } else { 1.0 }
}

/// The record kind of scans.
pub const SCAN: &str = "scan";

/// Scans on the station and measures.
pub fn at_station(input: &ScanInput, ctx: &StationContext) -> Result<Done, JobEnd> {
    Ok(at_station_measured(input, ctx)?.done())
}

/// The same without ending the job.
pub fn at_station_measured(input: &ScanInput, ctx: &StationContext) -> Result<Measured, JobEnd> {
    measured(station_source::run(input, ctx)?, ctx)
}

/// Scans the frames of a capture and measures.
pub fn of_capture(input: &ScanInput, frames: &RecordedFrames, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    Ok(of_capture_measured(input, frames, ctx)?.done())
}

/// The same without ending the job.
pub fn of_capture_measured(
    input: &ScanInput,
    frames: &RecordedFrames,
    ctx: &ComputeContext,
) -> Result<Measured, JobEnd> {
    measured(capture_source::run(input, frames, ctx)?, ctx)
}

#[cfg(test)]
pub(in crate::jobs) mod tests;
