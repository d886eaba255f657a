//! Reading stored scans.

use std::error::Error;
use std::io::BufReader;

use optics::StagePosition;
use scanning::files::peaks::{PeaksFile, read_one_frame, read_positions};
use scanning::files::read_cloud_from;
use scanning::{Cloud, CloudFormat, ScanFrame};
use store::{ArtifactBytes, ArtifactId, Artifacts, ScanRecord};

use crate::error::{AppError, ErrorKind};
use crate::resources::scan_run::ScanRun;

/// The id of a new record.
pub fn new_id() -> String {
    uuid::Uuid::now_v7().to_string()
}

/// The whole cloud of a scan in memory.
///
/// # Errors
/// A problem: the scan has no cloud (it was stopped), or the artifact is damaged.
pub async fn stored_cloud(artifacts: &dyn Artifacts, scan: &ScanRecord) -> Result<Cloud, AppError> {
    let bytes = stored_cloud_bytes(artifacts, scan).await?;
    parsed(&scan.id, "cloud", move || read_cloud_from(&mut BufReader::new(bytes), CloudFormat::Ply)).await
}

/// The bytes of the cloud of a scan, a PLY file, checked.
///
/// # Errors
/// As [`stored_cloud`].
pub async fn stored_cloud_bytes(artifacts: &dyn Artifacts, scan: &ScanRecord) -> Result<ArtifactBytes, AppError> {
    let Some(id) = &scan.cloud else { return Err(without_cloud(scan)) };
    let what = format!("the cloud of scan {}", scan.id);
    let lost = |error| AppError::from(error).of_stored(&what);
    artifacts.check(id).await.map_err(lost)?;
    artifacts.bytes(id).await.map_err(lost)
}

/// The frames of a scan, verified; they are read from their file on demand.
///
/// # Errors
/// A problem: the artifact is damaged.
pub async fn stored_peaks(
    artifacts: &dyn Artifacts,
    peaks: &ArtifactId,
    scan_id: &str,
) -> Result<PeaksFile, AppError> {
    let bytes = peaks_bytes(artifacts, peaks, scan_id).await?;
    parsed(scan_id, "peaks", move || PeaksFile::new(bytes)).await
}

/// The stage positions of the frames of a scan.
///
/// # Errors
/// A problem: the artifact is damaged.
pub async fn stored_positions(
    artifacts: &dyn Artifacts,
    scan: &ScanRecord,
) -> Result<Vec<StagePosition>, AppError> {
    let bytes = peaks_bytes(artifacts, &scan.peaks, &scan.id).await?;
    parsed(&scan.id, "peaks", move || read_positions(BufReader::new(bytes))).await
}

/// One frame of a scan with its time, or the number of frames if out of range; other frames are not read.
///
/// # Errors
/// A problem: the artifact is damaged.
pub async fn stored_frame(
    artifacts: &dyn Artifacts,
    scan: &ScanRecord,
    frame: usize,
) -> Result<Result<(ScanFrame, Option<u64>), usize>, AppError> {
    let bytes = peaks_bytes(artifacts, &scan.peaks, &scan.id).await?;
    parsed(&scan.id, "peaks", move || read_one_frame(bytes, frame)).await
}

async fn peaks_bytes(
    artifacts: &dyn Artifacts,
    id: &ArtifactId,
    scan_id: &str,
) -> Result<ArtifactBytes, AppError> {
    let bytes = artifacts.bytes(id).await;
    bytes.map_err(|error| AppError::from(error).of_stored(&format!("the peaks of scan {scan_id}")))
}

/// Runs a read of up to a second on a blocking thread.
async fn parsed<T: Send + 'static, E: Error + Send + 'static>(
    scan_id: &str,
    what: &str,
    parse: impl FnOnce() -> Result<T, E> + Send + 'static,
) -> Result<T, AppError> {
    match tokio::task::spawn_blocking(parse).await {
        Ok(read) => read.map_err(|error| damaged(scan_id, what, &error)),
        Err(stopped) => Err(damaged(scan_id, what, &stopped)),
    }
}

/// Name of a scan in the header of its cloud; for a capture, the name of its scan.
pub fn cloud_name(scan: &ScanRecord) -> String {
    ScanRun::of(scan).map_or_else(|_| scan.name.clone(), |run| run.cloud_name)
}

/// Why there is no cloud, and the remedy.
pub fn without_cloud(scan: &ScanRecord) -> AppError {
    AppError::new(ErrorKind::Conflict, format!("scan {} was stopped before its cloud was computed", scan.id))
        .remedy("resume the scan, or recompute it from its peaks")
}

fn damaged(scan_id: &str, what: &str, error: &dyn Error) -> AppError {
    AppError::damaged(&format!("the {what} of scan {scan_id}"), error.to_string())
}
