//! Scan a part: from the station row by row or in one sweep, or from the pictures of a capture.
//!
//! Whatever the source, every frame becomes centrelines, the centrelines are kept as peaks, and the cloud is computed
//! from them by the functions of `sheaf scan`: the same frames give the same bytes.

mod acquisition;
mod capture_source;
mod pictures;
mod recording;
mod result;
mod resume;
mod station_source;
mod timing;
mod work;
mod writing;

use crate::jobs::{Done, JobContext, JobEnd, ScanInput, ScanSource};

pub use result::{MadeScan, ScanStory, check_camera_of, made_scan, scan_changes};
pub use work::{forget_orphans, recover};

/// The kind of record that scans make.
pub const SCAN: &str = "scan";

/// Scans.
pub fn run(input: ScanInput, ctx: &JobContext) -> Result<Done, JobEnd> {
    Ok(make(&input, ctx)?.done())
}

/// Scans, and leaves it to the caller to end the job.
pub fn make(input: &ScanInput, ctx: &JobContext) -> Result<MadeScan, JobEnd> {
    match &input.source {
        ScanSource::Station => station_source::run(input, ctx),
        ScanSource::Capture { capture_id, scan } => capture_source::run(input, capture_id, scan.as_deref(), ctx),
    }
}

#[cfg(test)]
mod tests;
