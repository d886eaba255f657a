//! From frames to the stored results: peaks, cloud, report, record.

use crate::events::{Event, ScanCreated, event};
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Instant;

use calibration::CalibrationDocument;
use live::points::display_point_of_cloud;
use live::protocol::points::encode_block;
use scanning::files::peaks::PeaksFile;
use scanning::params::KEPT_POINTS;
use scanning::{Cloud, CloudFormat, CloudPoint, Evaluation, Frames as _};
use serde_json::{Value, json};
use station::wall_clock::now_ms;
use store::{ArtifactId, Change, FinishedFile, ScanRecord, ScanState};

use crate::error::AppError;
use crate::error::disk_problem;
use crate::jobs::plan::TIMING;
use crate::jobs::progress::Phase;
use crate::jobs::scan::counted::CountedFrames;
use crate::jobs::scan::watched::Watched;
use crate::jobs::{ComputeContext, JobEnd};
use crate::resources::stored_scan::stored_cloud;
use crate::resources::watches::why_invalid;
use pipeline::{WrittenCloud, check_camera, evaluated_scan, write_scan_cloud};
use report::tables::scan_json;

/// Checks that the frames match the calibrated camera.
pub fn check_camera_of(frames: &PeaksFile, document: &CalibrationDocument) -> Result<(), JobEnd> {
    let (width_px, height_px) = (frames.header.width_px as usize, frames.header.height_px as usize);
    Ok(check_camera(width_px, height_px, &document.calibration().camera)?)
}

/// Origin of a scan.
pub struct ScanStory {
    /// Id of the record.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Name in the header of the cloud; for a capture, the name of its scan.
    pub cloud_name: String,
    /// The plan.
    pub plan: Value,
    /// Its state.
    pub state: ScanState,
    /// Artifact of its peaks.
    pub peaks: ArtifactId,
    /// The capture with its images.
    pub capture_id: Option<String>,
    /// The scan it was recomputed from.
    pub recomputed_from: Option<String>,
    /// Display points as shown live; `None`: those of the cloud.
    pub display: Option<ArtifactId>,
    /// Whether a record with this id exists.
    pub replaces: bool,
    /// Why it is invalid, if so.
    pub losses: Vec<String>,
    /// Changes to store together with it.
    pub also: Vec<Change>,
}

/// A scan whose data are computed and stored, but not yet its record.
pub struct MadeScan {
    /// The record.
    pub record: ScanRecord,
    replaces: bool,
    n_points: usize,
    n_frames: usize,
    also: Vec<Change>,
    /// Progress of the job at this point.
    pub done_at: f64,
    /// Its id, if its work folder is kept until the record is stored.
    pub work_of: Option<String>,
    /// Its points, if they are few enough to be kept for the measurements.
    cloud: Option<Cloud>,
}

/// How the evaluation of a scan reports its progress.
pub struct Evaluating {
    /// The range of the job's progress.
    pub part: Range<f64>,
    /// Expected number of reads per frame, from recent scans.
    pub passes: f64,
}

/// Computes the cloud and stores the artifacts of the record.
pub fn made_scan(
    ctx: &ComputeContext,
    story: ScanStory,
    frames: &PeaksFile,
    document: &CalibrationDocument,
    evaluating: Evaluating,
) -> Result<MadeScan, JobEnd> {
    let began = Instant::now();
    let Evaluating { part, passes } = evaluating;
    let n_frames = frames.n_frames();
    ctx.report(part.start, Phase::ComputingCloud, "computing the cloud");
    let reporter = ctx.reporter(Phase::ComputingCloud, part.clone());
    let calibration = document.calibration();
    let to_read = (passes * n_frames as f64).max(1.0);
    let stage = AtomicU8::new(0);
    let on_read = |n_read: usize| {
        let fraction = part.start + (part.end - part.start) * (n_read as f64 / to_read).min(1.0);
        let (phase, words) = match stage.load(Ordering::Relaxed) {
            0 => (Phase::ComputingCloud, "computing the cloud"),
            _ => (Phase::StoringCloud, "storing the cloud"),
        };
        ctx.report(fraction, phase, words);
    };
    let counted = CountedFrames::new(frames, &on_read);
    let mut evaluation = evaluated_scan(&counted, document, &calibration, &story.cloud_name, &reporter)?;
    let mut watched = Watched::over(&evaluation, &calibration)?;
    let corrected = watched.corrected(&calibration);
    if let Some(corrected) = &corrected {
        evaluation = evaluated_scan(&counted, document, corrected, &story.cloud_name, &reporter)?;
        evaluation.comments.extend(watched.comment());
    }
    stage.store(1, Ordering::Relaxed);
    on_read(counted.n_read());
    ctx.check_cancelled()?;
    let mut kept = KeptCloud::new(ctx, &story, &evaluation, frames)?;
    ctx.report(part.end, Phase::StoringCloud, "storing the cloud");
    let n_points = evaluation.report.n_points;
    let (replaces, mut also) = (story.replaces, story.also.clone());
    let mut story = story;
    let mut report = scan_json(&story.cloud_name, &evaluation.report, kept.median_sigma_mm);
    also.extend(watched.apply_watches(
        ctx,
        &mut story,
        &mut report,
        (document.calibration.id.as_str(), kept.median_sigma_mm),
    )?);
    report["n_frames"] = json!(n_frames);
    report[TIMING] = json!({ "n_frames": n_frames, "frames_read": counted.n_read(),
        "evaluation_s": began.elapsed().as_secs_f64() });
    let points = kept.points.take();
    let cloud = points.map(|points| Cloud { points, comments: std::mem::take(&mut evaluation.comments) });
    let record = record(ctx, story, document, report, kept);
    also.extend(watched.remembered(ctx, &record)?);
    Ok(MadeScan { record, replaces, n_points, n_frames, also, done_at: part.end, work_of: None, cloud })
}

/// The stored artifacts of a cloud.
struct KeptCloud {
    cloud: ArtifactId,
    display: ArtifactId,
    median_sigma_mm: f64,
    points: Option<Vec<CloudPoint>>,
}

impl KeptCloud {
    /// Writes the points to disk as they are computed, and the display points if they were not shown live.
    fn new(
        ctx: &ComputeContext,
        story: &ScanStory,
        evaluation: &Evaluation,
        frames: &PeaksFile,
    ) -> Result<Self, JobEnd> {
        let place = tempfile::tempdir_in(ctx.artifacts.workbench().scratch()).map_err(disk_problem)?;
        let [cloud, blocks] = ["cloud.ply", "blocks"].map(|name| place.path().join(name));
        let mut display = match &story.display {
            Some(_) => None,
            None => Some(DisplayFile::create(&blocks, &story.id, frames)?),
        };
        let show = |points: &[CloudPoint]| -> Result<(), JobEnd> {
            Ok(display.as_mut().map_or(Ok(()), |display| display.add(points))?)
        };
        // As many points are kept for the measurements as by the evaluation: 110 MB.
        let WrittenCloud { median_sigma_mm, points } =
            write_scan_cloud(&cloud, CloudFormat::Ply, evaluation, KEPT_POINTS, show)?;
        let cloud = ctx.wait(ctx.artifacts.adopt(FinishedFile::at(&cloud)))?;
        let display = match (display, &story.display) {
            (_, Some(shown)) => shown.clone(),
            (written, None) => {
                written.map_or(Ok(()), DisplayFile::finish)?;
                ctx.wait(ctx.artifacts.adopt(FinishedFile::at(&blocks)))?
            }
        };
        Ok(Self { cloud, display, median_sigma_mm, points })
    }
}

/// The points of the cloud in the blocks of the live stream, one per frame.
struct DisplayFile<'a> {
    out: BufWriter<File>,
    scan_id: &'a str,
    frames: &'a PeaksFile,
    n_blocks: u32,
}

impl<'a> DisplayFile<'a> {
    fn create(path: &Path, scan_id: &'a str, frames: &'a PeaksFile) -> Result<Self, AppError> {
        let file = File::create_new(path).map_err(disk_problem)?;
        Ok(Self { out: BufWriter::new(file), scan_id, frames, n_blocks: 0 })
    }

    /// The points of one frame.
    fn add(&mut self, points: &[CloudPoint]) -> Result<(), AppError> {
        let Some(first) = points.first() else { return Ok(()) };
        let along_u = self.frames.header.line_direction == vision::LineDirection::Rows;
        let shown: Vec<_> = points.iter().map(|point| display_point_of_cloud(point, along_u)).collect();
        let position = self.frames.position(first.frame as usize).value();
        let block = encode_block(self.scan_id, self.n_blocks, first.frame, position, &shown);
        self.n_blocks += 1;
        self.out.write_all(&block).map_err(disk_problem)
    }

    fn finish(mut self) -> Result<(), AppError> {
        self.out.flush().map_err(disk_problem)
    }
}

fn record(
    ctx: &ComputeContext,
    story: ScanStory,
    document: &CalibrationDocument,
    mut report: Value,
    kept: KeptCloud,
) -> ScanRecord {
    report["losses"] = json!(story.losses);
    ScanRecord {
        id: story.id,
        name: story.name,
        state: story.state,
        calibration_id: document.calibration.id.clone(),
        plan: story.plan,
        peaks: story.peaks,
        capture_id: story.capture_id,
        cloud: Some(kept.cloud),
        display: Some(kept.display),
        report,
        recomputed_from: story.recomputed_from,
        job_id: Some(ctx.id.clone()),
        software_version: env!("CARGO_PKG_VERSION").to_owned(),
        created_at_ms: now_ms(),
    }
}

impl MadeScan {
    /// Message for the operator.
    pub fn message(&self) -> String {
        let worth = match self.record.state {
            ScanState::Complete => "",
            ScanState::Partial => "; the scan is partial",
            ScanState::Invalid => &format!("; the scan is invalid: {}", why_invalid(&self.record)),
        };
        format!("{} points from {} frames{worth}", self.n_points, self.n_frames)
    }

    /// Its cloud, for the measurements: from memory, or read again if it is large.
    pub fn cloud(&mut self, ctx: &ComputeContext) -> Result<Cloud, JobEnd> {
        match self.cloud.take() {
            Some(cloud) => Ok(cloud),
            None => Ok(ctx.wait(stored_cloud(&*ctx.artifacts, &self.record))?),
        }
    }

    /// The changes that store the record.
    pub fn changes(&self) -> Vec<Change> {
        let mut changes = self.also.clone();
        changes.extend(scan_changes(&self.record, self.replaces));
        changes
    }

    /// The same, with the work folder that a crash would need until the record is stored.
    pub fn with_work(self) -> Self {
        Self { work_of: Some(self.record.id.clone()), ..self }
    }
}

/// The changes that store the record of a scan, new or replacing its earlier version.
pub fn scan_changes(record: &ScanRecord, replaces: bool) -> Vec<Change> {
    let state = match record.state {
        ScanState::Complete => "complete",
        ScanState::Partial => "partial",
        ScanState::Invalid => "invalid",
    };
    let n_points = record.report["n_points"].as_u64();
    let body = ScanCreated { name: record.name.clone(), state: state.to_owned(), n_points };
    let created = event(&record.id, Event::ScanCreated(body));
    let record = record.clone();
    vec![if replaces { Change::ReplaceScan(record) } else { Change::InsertScan(record) }, created]
}
