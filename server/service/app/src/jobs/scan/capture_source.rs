//! A scan of a stored capture.

use capture::Capture;
use optics::StageKind;
use scanning::Frames as _;
use store::{FinishedFile, ScanState};

use crate::error::disk_problem;
use crate::error::{AppError, ErrorKind};
use crate::jobs::plan::{Pace, RequestedRange, ScanRun};
use crate::jobs::progress::Phase;
use crate::jobs::scan::{Evaluating, MadeScan, ScanStory, evaluated_share, made_scan};
use crate::jobs::{ComputeContext, JobEnd, RecordedFrames, ScanInput, ScanMode};
use crate::resources::calibrations::stored::stored_document;
use crate::resources::stored_scan::{new_id, stored_peaks};
use pipeline::{open_capture, write_capture_peaks};

/// Fraction of the job for reading the images.
const READING: f64 = 0.5;

/// Reads the images of one scan and computes its cloud.
pub fn run(input: &ScanInput, frames: &RecordedFrames, ctx: &ComputeContext) -> Result<MadeScan, JobEnd> {
    let RecordedFrames { capture_id, scan } = frames;
    refuse_station_fields(input)?;
    let document = ctx.wait(stored_document(&ctx.catalogue, &*ctx.artifacts, input.calibration_id.as_deref()))?;
    ctx.report(0.0, Phase::UnpackingCapture, "unpacking the capture");
    let checked_out = ctx.captures.check_out(capture_id)?;
    ctx.check_cancelled()?;
    let reporter = ctx.reporter(Phase::ReadingFrames, 0.0..READING);
    let capture = open_capture(&checked_out.folder, &reporter)?;
    let cloud_name = chosen_scan(&capture, scan.as_deref())?;
    let place = tempfile::tempdir_in(ctx.artifacts.workbench().scratch()).map_err(disk_problem)?;
    let path = place.path().join("peaks");
    write_capture_peaks(&capture, &document, &cloud_name, &path, &reporter)?;
    let peaks = ctx.wait(ctx.artifacts.adopt(FinishedFile::at(&path)))?;
    let id = new_id();
    let frames = ctx.wait(stored_peaks(&*ctx.artifacts, &peaks, &id))?;
    let run = ScanRun {
        source: input.source.clone(),
        cloud_name: cloud_name.clone(),
        n_rows: frames.n_frames(),
        measure: input.measure.clone(),
        purpose: input.purpose,
        plan: None,
    };
    let story = ScanStory {
        id,
        name: input.name.clone().unwrap_or_else(|| cloud_name.clone()),
        plan: run.to_stored(),
        cloud_name,
        state: ScanState::Complete,
        peaks,
        capture_id: Some(capture_id.clone()),
        recomputed_from: None,
        display: None,
        replaces: false,
        losses: Vec::new(),
        also: Vec::new(),
    };
    let pace = ctx.wait(Pace::learned(&ctx.catalogue, ScanMode::StopAndGo));
    let part = READING..evaluated_share(input.measure.len());
    made_scan(ctx, story, &frames, &document, Evaluating { part, passes: pace.passes })
}

/// Refuses input fields that apply only to a station, by name.
fn refuse_station_fields(input: &ScanInput) -> Result<(), AppError> {
    let ranges = [StageKind::Linear, StageKind::Rotary].map(|stage| RequestedRange::of(&input.settings, stage));
    let given = ranges.iter().flat_map(RequestedRange::given).map(|(field, _)| (field, true));
    let others = [
        ("mode", input.settings.mode.is_some()),
        ("exposure_us", input.settings.exposure_us.is_some()),
        ("exposures_us", !input.settings.exposures_us.is_empty()),
        ("laser_power", input.settings.laser_power.is_some()),
        ("keep_frames", input.settings.keep_frames),
        ("background", input.settings.background.is_some()),
        ("record", input.settings.record),
        ("resume_scan_id", input.resume_scan_id.is_some()),
    ];
    match given.chain(others).find(|(_, given)| *given) {
        None => Ok(()),
        Some((field, _)) => {
            Err(AppError::new(ErrorKind::Impossible, format!("{field} does not apply to a capture"))
                .at(format!("/{field}"))
                .remedy("omit it, or scan on the station"))
        }
    }
}

/// The named scan, or the only one.
fn chosen_scan(capture: &Capture, named: Option<&str>) -> Result<String, AppError> {
    let scans = &capture.manifest.scans;
    match (named, scans.as_slice()) {
        (Some(name), _) => Ok(capture.scan(name)?.name.clone()),
        (None, [only]) => Ok(only.name.clone()),
        (None, []) => Err(AppError::new(ErrorKind::Impossible, "the capture contains no scan")
            .remedy("use a capture with a scan; this one is for calibration")),
        (None, several) => {
            let names: Vec<&str> = several.iter().map(|scan| scan.name.as_str()).collect();
            let detail = format!("the capture contains {} scans: {}", names.len(), names.join(", "));
            Err(AppError::new(ErrorKind::Impossible, detail).at("/source/scan").remedy("name one of them"))
        }
    }
}
