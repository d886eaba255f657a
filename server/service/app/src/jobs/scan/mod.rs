//! Scan a part, from the station row by row or in one sweep or from the pictures of a capture, and measure it.
//!
//! Whatever the source, every frame becomes centrelines, the centrelines are kept as peaks, and the cloud is computed
//! from them by the functions of `sheaf scan`: the same frames give the same bytes.

mod capture_source;
mod counted;
mod measuring;
mod pictures;
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
pub use work::{clear_work, forget_orphans, recover};

/// Share of a job's own fraction after its frames. The shares are fixed, so that jobs can be compared: what they are in
/// time, is taken from the last jobs.
pub const TAKEN: f64 = 0.5;

/// Share after its cloud, where it is measured; else the cloud is the end.
const EVALUATED: f64 = 0.9;

/// Share after the cloud of a scan on which so many things are measured.
pub fn evaluated_share(n_measurements: usize) -> f64 {
    if n_measurements > 0 { EVALUATED } else { 1.0 }
}

/// The kind of record that scans make.
pub const SCAN: &str = "scan";

/// Scans from the station, and measures.
pub fn at_station(input: &ScanInput, ctx: &StationContext) -> Result<Done, JobEnd> {
    Ok(at_station_measured(input, ctx)?.done())
}

/// The same, and leaves it to the caller to end the job.
pub fn at_station_measured(input: &ScanInput, ctx: &StationContext) -> Result<Measured, JobEnd> {
    measured(station_source::run(input, ctx)?, ctx)
}

/// Scans the frames of a capture, and measures.
pub fn of_capture(input: &ScanInput, frames: &RecordedFrames, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    Ok(of_capture_measured(input, frames, ctx)?.done())
}

/// The same, and leaves it to the caller to end the job.
pub fn of_capture_measured(
    input: &ScanInput,
    frames: &RecordedFrames,
    ctx: &ComputeContext,
) -> Result<Measured, JobEnd> {
    measured(capture_source::run(input, frames, ctx)?, ctx)
}

#[cfg(test)]
mod tests;
