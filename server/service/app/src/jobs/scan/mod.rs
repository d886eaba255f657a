//! Scan a part, from the station row by row or in one sweep or from the pictures of a capture, and measure it.
//!
//! Whatever the source, every frame becomes centrelines, the centrelines are kept as peaks, and the cloud is computed
//! from them by the functions of `sheaf scan`: the same frames give the same bytes.

mod acquisition;
mod capture_source;
mod counted;
mod measuring;
mod pictures;
mod recording;
mod result;
mod resume;
mod station_source;
mod timing;
mod work;
mod writing;

use crate::jobs::{Done, JobContext, JobEnd, ScanInput, ScanSource};

pub use measuring::{Measured, measured};
pub use result::{Evaluating, MadeScan, ScanStory, check_camera_of, made_scan, scan_changes};
pub use work::{forget_orphans, recover};

/// Share of a job's own fraction after its frames. The shares are fixed, so that jobs can be compared: what they are in
/// time, the last jobs tell.
pub const TAKEN: f64 = 0.5;

/// Share after its cloud, where it is measured; else the cloud is the end.
const EVALUATED: f64 = 0.9;

/// Share after the cloud of a scan on which so many things are measured.
pub fn evaluated_share(n_measurements: usize) -> f64 {
    if n_measurements > 0 { EVALUATED } else { 1.0 }
}

/// The kind of record that scans make.
pub const SCAN: &str = "scan";

/// Scans and measures.
pub fn run(input: ScanInput, ctx: &JobContext) -> Result<Done, JobEnd> {
    Ok(scanned_and_measured(&input, ctx)?.done())
}

/// The same, and leaves it to the caller to end the job.
pub fn scanned_and_measured(input: &ScanInput, ctx: &JobContext) -> Result<Measured, JobEnd> {
    let made = make(input, ctx)?;
    let from = made.done_at;
    measured(made, ctx, from)
}

fn make(input: &ScanInput, ctx: &JobContext) -> Result<MadeScan, JobEnd> {
    match &input.source {
        ScanSource::Station => station_source::run(input, ctx),
        ScanSource::Capture { capture_id, scan } => capture_source::run(input, capture_id, scan.as_deref(), ctx),
    }
}

#[cfg(test)]
mod tests;
