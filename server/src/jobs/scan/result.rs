//! From frames to what is stored: peaks, cloud, figures, record.

use std::ops::Range;

use calibration::CalibrationDocument;
use scanning::files::peaks::{PeaksHeader, PeaksWriter};
use scanning::files::write_cloud;
use scanning::{CloudFormat, ScanFrame, ScanResult};
use serde_json::{Value, json};
use store::{ArtifactId, Change, ResultRef, ScanRecord, ScanState};

use crate::jobs::scan::SCAN;
use crate::jobs::{Done, JobContext, JobEnd};
use crate::ledger::event;
use crate::live::points::{PointLog, display_point_of_cloud};
use crate::pipeline::{check_camera, scan_frames};
use crate::stored_scan::disk_problem;
use crate::tables::scan_json;
use crate::wall_clock::now_ms;

/// The frames of a scan with what holds for all of them.
pub struct FrameSet {
    /// Size and line direction.
    pub header: PeaksHeader,
    /// Centrelines and positions in order of capture.
    pub frames: Vec<ScanFrame>,
    /// Per frame, by the station's clock.
    pub captured_at_ns: Vec<Option<u64>>,
}

impl FrameSet {
    /// Whether the frames are of the calibrated camera.
    pub fn check_camera(&self, document: &CalibrationDocument) -> Result<(), JobEnd> {
        let (width_px, height_px) = (self.header.width_px as usize, self.header.height_px as usize);
        Ok(check_camera(width_px, height_px, &document.calibration().camera)?)
    }
}

/// How a scan came about.
pub struct ScanStory {
    /// Of the record.
    pub id: String,
    /// What a person calls it.
    pub name: String,
    /// What the cloud's header calls it; for a capture its scan, whatever a person calls the result.
    pub cloud_name: String,
    /// What it was made by.
    pub plan: Value,
    /// What it is worth.
    pub state: ScanState,
    /// Its frames, stored.
    pub peaks: ArtifactId,
    /// Its pictures, stored.
    pub capture_id: Option<String>,
    /// The scan it was computed from.
    pub recomputed_from: Option<String>,
    /// Points as they were shown live; `None`: those of the cloud.
    pub display: Option<ArtifactId>,
    /// Whether a record of this id exists.
    pub replaces: bool,
    /// Why it is invalid, if it is.
    pub losses: Vec<String>,
    /// What is stored together with it.
    pub also: Vec<Change>,
}

/// Stores frames as peaks.
pub fn keep_peaks(ctx: &JobContext, frames: &FrameSet) -> Result<ArtifactId, JobEnd> {
    let place = tempfile::tempdir_in(ctx.artifacts.scratch()).map_err(disk_problem)?;
    let path = place.path().join("peaks");
    let mut writer = PeaksWriter::create(&path, &frames.header).map_err(disk_problem)?;
    for (frame, captured_at_ns) in frames.frames.iter().zip(&frames.captured_at_ns) {
        writer.add(frame, *captured_at_ns).map_err(disk_problem)?;
    }
    writer.finish().map_err(disk_problem)?;
    Ok(ctx.wait(ctx.artifacts.adopt(&path))?)
}

/// A scan that was computed and stored, but for its record.
pub struct MadeScan {
    /// The record.
    pub record: ScanRecord,
    /// Points and figures.
    pub result: ScanResult,
    replaces: bool,
    n_frames: usize,
    also: Vec<Change>,
}

/// Computes the cloud and stores what the record names.
pub fn made_scan(
    ctx: &JobContext,
    story: ScanStory,
    frames: &FrameSet,
    document: &CalibrationDocument,
    part: Range<f64>,
) -> Result<MadeScan, JobEnd> {
    let end = part.end;
    ctx.report(part.start, "computing the cloud");
    let reporter = ctx.reporter(part);
    let result = scan_frames(&frames.frames, document, &story.cloud_name, &reporter)?;
    ctx.report(end, "storing the cloud");
    ctx.go_on()?;
    let cloud = keep_cloud(ctx, &result)?;
    let display = match &story.display {
        Some(blocks) => blocks.clone(),
        None => keep_display(ctx, &story.id, &result, frames)?,
    };
    let replaces = story.replaces;
    let also = story.also.clone();
    let record = record(ctx, story, frames, document, &result, cloud, display);
    Ok(MadeScan { record, result, replaces, n_frames: frames.frames.len(), also })
}

fn keep_cloud(ctx: &JobContext, result: &ScanResult) -> Result<ArtifactId, JobEnd> {
    let place = tempfile::tempdir_in(ctx.artifacts.scratch()).map_err(disk_problem)?;
    let path = place.path().join("cloud.ply");
    write_cloud(&path, CloudFormat::Ply, &result.cloud).map_err(disk_problem)?;
    Ok(ctx.wait(ctx.artifacts.adopt(&path))?)
}

/// The points of the cloud in the blocks of the live stream, one per frame.
fn keep_display(
    ctx: &JobContext,
    scan_id: &str,
    result: &ScanResult,
    frames: &FrameSet,
) -> Result<ArtifactId, JobEnd> {
    let along_u = frames.header.line_direction == vision::LineDirection::Rows;
    let log = PointLog::new(scan_id);
    for points in result.cloud.points.chunk_by(|a, b| a.frame == b.frame) {
        let frame = points[0].frame;
        let shown: Vec<_> = points.iter().map(|point| display_point_of_cloud(point, along_u)).collect();
        log.add(frame, frames.frames[frame as usize].position_mm, &shown);
    }
    let blocks = log.blocks_from(0, usize::MAX).concat();
    Ok(ctx.wait(ctx.artifacts.put(&blocks))?)
}

fn record(
    ctx: &JobContext,
    story: ScanStory,
    frames: &FrameSet,
    document: &CalibrationDocument,
    result: &ScanResult,
    cloud: ArtifactId,
    display: ArtifactId,
) -> ScanRecord {
    let mut report = scan_json(&story.cloud_name, result);
    report["n_frames"] = json!(frames.frames.len());
    report["losses"] = json!(story.losses);
    ScanRecord {
        id: story.id,
        name: story.name,
        state: story.state,
        calibration_id: document.calibration.id.clone(),
        plan: story.plan,
        peaks: story.peaks,
        capture_id: story.capture_id,
        cloud: Some(cloud),
        display: Some(display),
        report,
        recomputed_from: story.recomputed_from,
        job_id: Some(ctx.id.clone()),
        software_version: env!("CARGO_PKG_VERSION").to_owned(),
        created_at_ms: now_ms(),
    }
}

impl MadeScan {
    /// In the operator's words.
    pub fn message(&self) -> String {
        let worth = match self.record.state {
            ScanState::Complete => "",
            ScanState::Partial => "; the scan is partial",
            ScanState::Invalid => "; frames were lost: the scan is invalid",
        };
        format!("{} points from {} frames{worth}", self.result.report.n_points, self.n_frames)
    }

    /// What stores the record.
    pub fn changes(&self) -> Vec<Change> {
        let mut changes = self.also.clone();
        changes.extend(scan_changes(&self.record, self.replaces));
        changes
    }

    /// The end of a job that made a scan.
    pub fn done(self) -> Done {
        let result = ResultRef { kind: SCAN.to_owned(), id: self.record.id.clone() };
        Done { result, message: self.message(), changes: self.changes() }
    }
}

/// What stores the record of a scan, new or in place of its earlier self.
pub fn scan_changes(record: &ScanRecord, replaces: bool) -> Vec<Change> {
    let body = json!({ "name": record.name, "state": record.state, "n_points": record.report["n_points"] });
    let told = event("scan.made", &record.id, body);
    let record = record.clone();
    vec![if replaces { Change::ReplaceScan(record) } else { Change::InsertScan(record) }, told]
}
