//! A scan from the station: planned, taken row by row or in one sweep, every frame kept as it comes.

use calibration::CalibrationDocument;
use optics::Triangulator;
use scanning::files::peaks::PeaksHeader;
use scanning::label_frame;
use serde_json::{Value, json};
use store::{ArtifactId, ScanState};

use crate::jobs::plan::{ScanPlan, plan};
use crate::jobs::scan::acquisition::{TAKING, gaps, take_frames};
use crate::jobs::scan::pictures::{line_direction, take_in};
use crate::jobs::scan::recording::{PeaksFile, Recorder};
use crate::jobs::scan::resume::earlier;
use crate::jobs::scan::work::{Work, WorkNote};
use crate::jobs::scan::{FrameSet, MadeScan, ScanStory, made_scan, scan_changes};
use crate::jobs::{JobContext, JobEnd, ScanInput, ScanMode};
use crate::problem::{Problem, ProblemKind};
use crate::stored_calibration::stored_document;
use crate::stored_scan::{disk_problem, new_id};

/// What a scan is called if nobody gives it a name.
const DEFAULT_NAME: &str = "scan";

/// Scans from the station, anew or from where an earlier scan was stopped.
pub fn run(input: &ScanInput, ctx: &JobContext) -> Result<MadeScan, JobEnd> {
    let earlier = earlier(input, ctx)?;
    let input = earlier.as_ref().map_or_else(|| input.clone(), |earlier| earlier.filled(input));
    let document = ctx.wait(stored_document(&ctx.ledger, &*ctx.artifacts, input.calibration_id.as_deref()))?;
    let calibration = document.calibration();
    let planned = plan(&input, &calibration, &ctx.station.status())?;
    let (note, mut frames) = match earlier {
        Some(earlier) => {
            earlier.check(&planned)?;
            let record = earlier.record;
            let note = WorkNote {
                scan_id: record.id,
                name: record.name,
                plan: record.plan,
                calibration_id: record.calibration_id,
                job_id: ctx.id.clone(),
                replaces: true,
                losses: earlier.losses,
            };
            (note, earlier.frames)
        }
        None => (new_note(&input, &planned, &document, ctx)?, no_frames(ctx)),
    };
    let (mut work, mut peaks) = Work::begin(&*ctx.artifacts, note, &frames, planned.keep_frames)?;
    let triangulator = Triangulator::new(calibration);
    show_earlier(ctx, &work.note.scan_id, &frames, &triangulator);
    let taken = take(ctx, &planned, &triangulator, &mut work, &mut frames, &mut peaks);
    let blocks = ctx.live.end_scan(&work.note.scan_id).concat();
    let stopped = Stopped { ctx, work: &work, n_frames: frames.frames.len() };
    let peaks = match stopped.keep_peaks(peaks, &blocks) {
        Ok(kept) => kept,
        // Nothing was taken, or nothing can be kept: why taking ended matters more.
        Err(end) => return Err(taken.err().unwrap_or(end)),
    };
    match taken.and_then(|()| complete(ctx, &planned, &work, &frames, &document, peaks.clone())) {
        Ok(made) => {
            work.clear();
            Ok(made)
        }
        Err(end) => Err(stopped.as_partial(end, peaks)),
    }
}

fn new_note(
    input: &ScanInput,
    planned: &ScanPlan,
    document: &CalibrationDocument,
    ctx: &JobContext,
) -> Result<WorkNote, Problem> {
    let name = input.name.clone().unwrap_or_else(|| DEFAULT_NAME.to_owned());
    Ok(WorkNote {
        scan_id: new_id(),
        plan: plan_value(planned, &name)?,
        name,
        calibration_id: document.calibration.id.clone(),
        job_id: ctx.id.clone(),
        replaces: false,
        losses: Vec::new(),
    })
}

/// The plan as it is stored: with the source and the name in the cloud's header.
fn plan_value(planned: &ScanPlan, name: &str) -> Result<Value, Problem> {
    let mut value = serde_json::to_value(planned).map_err(disk_problem)?;
    value["source"] = json!({ "kind": "station" });
    value["scan"] = json!(name);
    Ok(value)
}

fn no_frames(ctx: &JobContext) -> FrameSet {
    let roi = ctx.station.status().camera_settings.roi;
    let header = PeaksHeader {
        width_px: roi.width_px as u32,
        height_px: roi.height_px as u32,
        line_direction: line_direction(&ctx.config),
    };
    FrameSet { header, frames: Vec::new(), captured_at_ns: Vec::new() }
}

/// The points that are there already are shown again: viewers see one scan.
fn show_earlier(ctx: &JobContext, scan_id: &str, frames: &FrameSet, triangulator: &Triangulator) {
    let calibration = triangulator.calibration();
    ctx.live.begin_scan(scan_id);
    for (idx, frame) in frames.frames.iter().enumerate() {
        let profile = label_frame(&frame.centrelines, triangulator, calibration.depth_range_mm);
        ctx.live.add_profile_points(scan_id, idx as u32, frame.position_mm, &profile, calibration);
    }
}

fn take(
    ctx: &JobContext,
    planned: &ScanPlan,
    triangulator: &Triangulator,
    work: &mut Work,
    frames: &mut FrameSet,
    peaks: &mut PeaksFile,
) -> Result<(), JobEnd> {
    let positions_mm = positions_mm(frames);
    let scan_id = work.note.scan_id.clone();
    let pictures = planned.keep_frames.then(|| work.pictures());
    let recorder = Recorder { ctx, scan_id: &scan_id, triangulator, pictures };
    let losses = &mut work.note.losses;
    recorder.record(frames, peaks, |hand| take_frames(ctx, planned, &positions_mm, losses, hand))
}

fn positions_mm(frames: &FrameSet) -> Vec<f64> {
    frames.frames.iter().map(|frame| frame.position_mm).collect()
}

/// Every row is there: pictures, cloud, record.
fn complete(
    ctx: &JobContext,
    planned: &ScanPlan,
    work: &Work,
    frames: &FrameSet,
    document: &CalibrationDocument,
    kept: Kept,
) -> Result<MadeScan, JobEnd> {
    let note = &work.note;
    let mut losses = note.losses.clone();
    if planned.mode == ScanMode::Continuous {
        losses.extend(gaps(planned, &positions_mm(frames)));
    }
    let mut also = Vec::new();
    let mut capture_id = None;
    if planned.keep_frames {
        ctx.report(TAKING, "packing the pictures");
        let (id, change) = take_in(ctx, &work.pictures(), &note.name, &note.name, frames)?;
        capture_id = Some(id);
        also.push(change);
    }
    let story = ScanStory {
        id: note.scan_id.clone(),
        name: note.name.clone(),
        cloud_name: note.name.clone(),
        plan: note.plan.clone(),
        state: if losses.is_empty() { ScanState::Complete } else { ScanState::Invalid },
        peaks: kept.peaks,
        capture_id,
        recomputed_from: None,
        display: Some(kept.display),
        replaces: note.replaces,
        losses,
        also,
    };
    made_scan(ctx, story, frames, document, TAKING..1.0)
}

/// What is stored of a scan before its cloud.
#[derive(Clone)]
struct Kept {
    peaks: ArtifactId,
    display: ArtifactId,
}

/// A scan that may end before its time.
struct Stopped<'a> {
    ctx: &'a JobContext,
    work: &'a Work,
    n_frames: usize,
}

impl Stopped<'_> {
    fn keep_peaks(&self, peaks: PeaksFile, blocks: &[u8]) -> Result<Kept, JobEnd> {
        if self.n_frames == 0 {
            self.work.clear();
            return Err(Problem::new(ProblemKind::DeviceFault, "the station delivered no frame")
                .remedy("check camera and trigger")
                .into());
        }
        peaks.finish().map_err(disk_problem)?;
        let artifacts = &self.ctx.artifacts;
        let peaks = self.ctx.wait(self.work.keep_peaks(&**artifacts))?;
        let display = self.ctx.wait(artifacts.put(blocks))?;
        Ok(Kept { peaks, display })
    }

    /// Stores what there is as a partial scan, and tells how to go on.
    fn as_partial(&self, end: JobEnd, kept: Kept) -> JobEnd {
        let why = match &end {
            JobEnd::Cancelled => "stopped by a person".to_owned(),
            JobEnd::Failed(problem) => problem.detail.clone(),
        };
        let record = self.work.partial(self.n_frames, kept.peaks, Some(kept.display), &why);
        let changes = scan_changes(&record, self.work.note.replaces);
        if let Err(error) = self.ctx.wait(self.ctx.ledger.commit(changes)) {
            tracing::error!(scan = %record.id, %error, "a stopped scan cannot be kept");
            return end;
        }
        self.work.clear_but_pictures();
        match end {
            JobEnd::Cancelled => JobEnd::Cancelled,
            JobEnd::Failed(mut problem) => {
                let go_on = format!("then resume scan {}", record.id);
                problem.remedy = Some(match problem.remedy.take() {
                    Some(remedy) => format!("{remedy}; {go_on}"),
                    None => go_on,
                });
                JobEnd::Failed(problem)
            }
        }
    }
}
