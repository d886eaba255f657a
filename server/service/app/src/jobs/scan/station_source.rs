//! A scan on the station: planned, captured row by row or continuously, every frame stored as it arrives.

use parking_lot::Mutex;
use std::time::Instant;

use bytes::Bytes;
use calibration::CalibrationDocument;
use optics::Triangulator;
use scanning::files::peaks::{PeaksFile, PeaksHeader};
use scanning::{Frames as _, FusionCounts, label_frame};
use serde_json::{Value, json};
use store::{ArtifactId, RecordingRecord, ScanState};

use crate::error::disk_problem;
use crate::error::{AppError, ErrorKind};
use crate::jobs::plan::{Pace, ScanPlan, ScanRun, TIMING, plan};
use crate::jobs::progress::Phase;
use crate::jobs::scan::images::take_in;
use crate::jobs::scan::resume::earlier;
use crate::jobs::scan::taking::acquisition::{AmbientLight, gaps, take_frames};
use crate::jobs::scan::taking::backgrounds::{BackgroundLog, noted};
use crate::jobs::scan::taking::recording::Recorder;
use crate::jobs::scan::taking::writing::{Kept, NewPeaks};
use crate::jobs::scan::timing::Timing;
use crate::jobs::scan::work::{Work, WorkNote};
use crate::jobs::scan::{Evaluating, MadeScan, ScanStory, TAKEN, evaluated_share, made_scan, scan_changes};
use crate::jobs::{JobEnd, ScanInput, ScanMode, ScanSource, StationContext};
use crate::recordings::RecordingOf;
use crate::recordings::figures::Ended;
use crate::resources::calibrations::stored::stored_document;
use crate::resources::measurements::parts::planned_measurements;
use crate::resources::stored_scan::{new_id, stored_peaks};

/// Key of the ambient light subtraction in a scan report.
const BACKGROUND: &str = "background";

/// Default name of a scan.
const DEFAULT_NAME: &str = "scan";

/// Scans on the station, from the start or from where an earlier scan was stopped.
pub fn run(input: &ScanInput, ctx: &StationContext) -> Result<MadeScan, JobEnd> {
    let earlier = earlier(input, ctx)?;
    let input = earlier.as_ref().map_or_else(|| input.clone(), |earlier| earlier.filled(input));
    let document = ctx.wait(stored_document(&ctx.catalogue, &*ctx.artifacts, input.calibration_id.as_deref()))?;
    let calibration = document.calibration();
    let pace = ctx.wait(Pace::learned(&ctx.catalogue, input.settings.mode()));
    let planned = plan(&input, &calibration, &ctx.station.status(), &pace)?;
    let (note, earlier) = match earlier {
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
            (note, Some(earlier.frames))
        }
        None => (new_note(&input, &planned, &document, ctx), None),
    };
    let header = earlier.as_ref().map_or_else(|| header(&planned, ctx), |earlier| earlier.header);
    let earlier = earlier.as_ref();
    let (mut work, mut peaks) = Work::begin(&*ctx.artifacts, note, &header, earlier, planned.keep_frames)?;
    let triangulator = Triangulator::new(calibration);
    // Before anything moves: later it would delay frames.
    triangulator.fill();
    let mut positions = show_earlier(ctx, &work.note.scan_id, earlier, &triangulator)?;
    let recording = start_recording(ctx, &input, &work.note, planned.disk_bytes).inspect_err(|_| {
        // Nothing was captured: remove what was prepared.
        ctx.live.end_scan(&work.note.scan_id);
        if work.note.replaces { work.clear_but_pictures() } else { work.clear() }
    })?;
    let dark_frame_use = ctx.station.status().dark_frame_use;
    let mut timing = Timing::default();
    let (n_before, began) = (positions.len(), Instant::now());
    let log = BackgroundLog::new(planned.keep_frames.then(|| (work.backgrounds(), work.images())))?;
    let taken = take(
        ctx,
        &planned,
        &triangulator,
        &mut work,
        Side { log: &log, recording: recording.as_deref() },
        &mut Kept { positions: &mut positions, peaks: &mut peaks, timing: &mut timing },
    );
    if let Some(id) = &recording {
        ctx.wait(ctx.recordings.end(Some(id), Ended::ScanEnded));
    }
    let acquired =
        Acquired { took_s: began.elapsed().as_secs_f64(), n_rows: positions.len() - n_before, pace, timing };
    let background = taken.as_ref().ok().and_then(|(ambient, _)| background_json(&planned, ambient, &log));
    let blocks = ctx.live.end_scan(&work.note.scan_id);
    let stopped = Stopped { ctx, work: &work, n_frames: positions.len() };
    let peaks = match stopped.keep_peaks(peaks, &blocks) {
        Ok(kept) => kept,
        // Nothing was captured or can be kept: the reason of the end takes precedence.
        Err(end) => return Err(taken.err().unwrap_or(end)),
    };
    let completed = taken.and_then(|(_, fusion)| {
        let mut made = complete(ctx, &planned, &work, &document, peaks.clone(), &acquired)?;
        if !planned.exposures_us.is_empty() {
            made.record.report["exposures"] = fusion_json(&planned.exposures_us, &fusion);
        }
        made.record.report["dark_frame"] = json!(dark_frame_use.name());
        if let Some(background) = background {
            made.record.report[BACKGROUND] = background;
        }
        Ok(made)
    });
    match completed {
        Ok(made) => Ok(made.with_work()),
        Err(end) => Err(stopped.as_partial(end, peaks)),
    }
}

fn new_note(
    input: &ScanInput,
    planned: &ScanPlan,
    document: &CalibrationDocument,
    ctx: &StationContext,
) -> WorkNote {
    let name = input.name.clone().unwrap_or_else(|| DEFAULT_NAME.to_owned());
    WorkNote {
        scan_id: new_id(),
        plan: run_of(planned, &name, input).to_stored(),
        name,
        calibration_id: document.calibration.id.clone(),
        job_id: ctx.id.clone(),
        replaces: false,
        losses: Vec::new(),
    }
}

fn run_of(planned: &ScanPlan, name: &str, input: &ScanInput) -> ScanRun {
    ScanRun {
        source: ScanSource::Station,
        cloud_name: name.to_owned(),
        n_rows: planned.n_rows,
        measure: input.measure.clone(),
        purpose: input.purpose,
        plan: Some(planned.clone()),
    }
}

fn header(planned: &ScanPlan, ctx: &StationContext) -> PeaksHeader {
    let roi = ctx.station.status().camera_settings.roi;
    PeaksHeader {
        width_px: roi.width_px as u32,
        height_px: roi.height_px as u32,
        line_direction: ctx.config.projector.direction_of(0),
        stage: planned.range.stage,
    }
}

/// Shows the existing points again so that viewers see one scan; returns their stage positions.
fn show_earlier(
    ctx: &StationContext,
    scan_id: &str,
    frames: Option<&PeaksFile>,
    triangulator: &Triangulator,
) -> Result<Vec<f64>, AppError> {
    let calibration = triangulator.calibration();
    ctx.live.begin_scan(scan_id);
    let Some(frames) = frames else { return Ok(Vec::new()) };
    for idx in 0..frames.n_frames() {
        let frame = frames.frame(idx).map_err(disk_problem)?;
        let profile = label_frame(&frame.centrelines, triangulator, calibration.depth_range_mm);
        ctx.live.add_profile_points(scan_id, idx as u32, frame.position, &profile, calibration);
    }
    Ok((0..frames.n_frames()).map(|idx| frames.position(idx).value()).collect())
}

/// Starts a recording if requested; returns its id. A disk that fills up later ends the recording, not the scan.
fn start_recording(
    ctx: &StationContext,
    input: &ScanInput,
    note: &WorkNote,
    needed_bytes: u64,
) -> Result<Option<String>, AppError> {
    if !input.settings.record {
        return Ok(None);
    }
    let of = RecordingOf::Scan {
        scan_id: note.scan_id.clone(),
        calibration_id: note.calibration_id.clone(),
        needed_bytes,
    };
    let nothing = |_: &RecordingRecord| Ok::<_, AppError>(Vec::new());
    Ok(Some(ctx.wait(ctx.recordings.begin(&note.name, of, None, nothing))?.id))
}

/// What is stored in addition to the rows.
struct Side<'a> {
    log: &'a BackgroundLog,
    /// The recording of this scan, if any.
    recording: Option<&'a str>,
}

fn take(
    ctx: &StationContext,
    planned: &ScanPlan,
    triangulator: &Triangulator,
    work: &mut Work,
    side: Side<'_>,
    kept: &mut Kept<'_>,
) -> Result<(AmbientLight, FusionCounts), JobEnd> {
    let earlier = kept.positions.clone();
    kept.positions.reserve(planned.n_rows.saturating_sub(earlier.len()));
    let scan_id = work.note.scan_id.clone();
    let images = planned.keep_frames.then(|| work.images());
    let Side { log, recording } = side;
    let notes = recording.and_then(|id| ctx.recordings.notes(id));
    let fusion = Mutex::default();
    let recorder = Recorder { ctx, scan_id: &scan_id, triangulator, images, log, fusion, notes };
    let losses = &mut work.note.losses;
    let ambient = recorder.record(kept, |hand| take_frames(ctx, planned, &earlier, losses, log, hand))?;
    Ok((ambient, recorder.fusion.into_inner()))
}

/// All rows are captured: stores images, cloud and record.
fn complete(
    ctx: &StationContext,
    planned: &ScanPlan,
    work: &Work,
    document: &CalibrationDocument,
    stored: Stored,
    acquired: &Acquired,
) -> Result<MadeScan, JobEnd> {
    let note = &work.note;
    let frames = ctx.wait(stored_peaks(&*ctx.artifacts, &stored.peaks, &note.scan_id))?;
    let positions: Vec<f64> = (0..frames.n_frames()).map(|idx| frames.position(idx).value()).collect();
    let mut losses = note.losses.clone();
    if planned.mode == ScanMode::Continuous {
        losses.extend(gaps(&planned.range, &positions));
    }
    let mut also = Vec::new();
    let mut capture_id = None;
    if planned.keep_frames {
        ctx.report(TAKEN, Phase::PackingImages, "packing the images");
        let (id, change) =
            take_in(ctx, &work.images(), &note.name, &note.name, &frames, &noted(&work.backgrounds()))?;
        capture_id = Some(id);
        also.push(change);
    }
    let story = ScanStory {
        id: note.scan_id.clone(),
        name: note.name.clone(),
        cloud_name: note.name.clone(),
        plan: note.plan.clone(),
        state: if losses.is_empty() { ScanState::Complete } else { ScanState::Invalid },
        peaks: stored.peaks,
        capture_id,
        recomputed_from: None,
        display: Some(stored.display),
        replaces: note.replaces,
        losses,
        also,
    };
    let n_measurements = planned_measurements(&note.plan).len();
    let evaluating = Evaluating { part: TAKEN..evaluated_share(n_measurements), passes: acquired.pace.passes };
    let mut made = made_scan(ctx, story, &frames, document, evaluating)?;
    acquired.add_to(&mut made.record.report[TIMING], planned);
    Ok(made)
}

fn fusion_json(exposures_us: &[f64], counts: &FusionCounts) -> Value {
    json!({
        "exposures_us": exposures_us,
        "n_points": counts.n_points,
        "n_replaced": counts.n_replaced,
        "n_saturated": counts.n_saturated,
        "n_disagreeing": counts.n_disagreeing,
    })
}

/// The ambient light subtraction, for the scan report.
fn background_json(planned: &ScanPlan, ambient: &AmbientLight, log: &BackgroundLog) -> Option<Value> {
    planned.background?;
    let counts = log.counts();
    Some(json!({
        "ambient_levels": ambient.levels,
        "ambient_levels_at_end": ambient.last_levels,
        "n_images": ambient.n_images,
        "n_frames_with": counts.n_with,
        "n_frames_without": counts.n_without,
    }))
}

/// Durations of the acquisition.
struct Acquired {
    took_s: f64,
    n_rows: usize,
    /// The durations that the plan assumed.
    pace: Pace,
    timing: Timing,
}

impl Acquired {
    /// For the scan report; future plans use it.
    fn add_to(&self, report: &mut Value, planned: &ScanPlan) {
        // The planned duration of motion and exposures for the rows captured now.
        let motion_s = planned.acquisition_s - planned.n_rows as f64 * self.pace.row_overhead_s;
        let share = self.n_rows as f64 / planned.n_rows.max(1) as f64;
        report["acquisition_s"] = json!(self.took_s);
        report["n_rows"] = json!(self.n_rows);
        report["waiting_s"] = json!(self.took_s - share * motion_s);
        if let (Some(report), Some(Value::Object(frames))) = (report.as_object_mut(), self.timing.to_json()) {
            report.extend(frames);
        }
    }
}

/// The data of a scan before its cloud.
#[derive(Clone)]
struct Stored {
    peaks: ArtifactId,
    display: ArtifactId,
}

/// A scan that may end early.
struct Stopped<'a> {
    ctx: &'a StationContext,
    work: &'a Work,
    n_frames: usize,
}

impl Stopped<'_> {
    fn keep_peaks(&self, peaks: NewPeaks, blocks: &[Bytes]) -> Result<Stored, JobEnd> {
        if self.n_frames == 0 {
            self.work.clear();
            return Err(AppError::new(ErrorKind::DeviceFault, "the station delivered no frame")
                .remedy("check camera and trigger")
                .into());
        }
        peaks.finish().map_err(disk_problem)?;
        let artifacts = &self.ctx.artifacts;
        let peaks = self.ctx.wait(self.work.keep_peaks(&**artifacts))?;
        let display = self.ctx.wait(async {
            let mut display = artifacts.create().await?;
            for block in blocks {
                display.write(block).await?;
            }
            display.finish().await
        })?;
        Ok(Stored { peaks, display })
    }

    /// Stores the rows taken as a partial scan, and says how to resume.
    fn as_partial(&self, end: JobEnd, stored: Stored) -> JobEnd {
        let why = match &end {
            JobEnd::Cancelled | JobEnd::CancelledAfter(_) => "stopped by a user".to_owned(),
            JobEnd::Failed(problem) => problem.detail.clone(),
        };
        let record = self.work.partial(self.n_frames, stored.peaks, Some(stored.display), &why);
        let changes = scan_changes(&record, self.work.note.replaces);
        if let Err(error) = self.ctx.wait(self.ctx.catalogue.commit(changes)) {
            tracing::error!(scan = %record.id, %error, "a stopped scan cannot be stored");
            return end;
        }
        self.work.clear_but_pictures();
        match end {
            cancelled @ (JobEnd::Cancelled | JobEnd::CancelledAfter(_)) => cancelled,
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
