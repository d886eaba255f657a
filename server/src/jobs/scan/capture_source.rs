//! A scan of a stored capture.

use capture::Capture;
use scanning::files::peaks::PeaksHeader;
use serde_json::json;
use store::ScanState;

use crate::jobs::scan::{FrameSet, MadeScan, ScanStory, keep_peaks, made_scan};
use crate::jobs::{JobContext, JobEnd, ScanInput};
use crate::pipeline::{capture_frames, open_capture};
use crate::problem::{Problem, ProblemKind};
use crate::stored_calibration::stored_document;
use crate::stored_scan::new_id;

/// Share of the job that reading the pictures takes.
const READING: f64 = 0.8;

/// Reads the pictures of one scan and computes its cloud.
pub fn run(input: &ScanInput, capture_id: &str, scan: Option<&str>, ctx: &JobContext) -> Result<MadeScan, JobEnd> {
    refuse_station_fields(input)?;
    let document = ctx.wait(stored_document(&ctx.ledger, &*ctx.artifacts, input.calibration_id.as_deref()))?;
    ctx.report(0.0, "unpacking the capture");
    let checked_out = ctx.captures.check_out(capture_id)?;
    ctx.go_on()?;
    let reporter = ctx.reporter(0.0..READING);
    let capture = open_capture(&checked_out.folder, &reporter)?;
    let cloud_name = chosen_scan(&capture, scan)?;
    let frames = capture_frames(&capture, &document, &cloud_name, &reporter)?;
    let camera = capture.manifest.camera;
    let header = PeaksHeader {
        width_px: camera.width_px as u32,
        height_px: camera.height_px as u32,
        line_direction: capture.manifest.line_direction(),
    };
    let frames = FrameSet { header, captured_at_ns: vec![None; frames.len()], frames };
    let peaks = keep_peaks(ctx, &frames)?;
    let story = ScanStory {
        id: new_id(),
        name: input.name.clone().unwrap_or_else(|| cloud_name.clone()),
        plan: json!({ "source": input.source, "scan": cloud_name, "n_rows": frames.frames.len() }),
        cloud_name,
        state: ScanState::Complete,
        peaks,
        capture_id: Some(capture_id.to_owned()),
        recomputed_from: None,
        display: None,
        replaces: false,
        losses: Vec::new(),
        also: Vec::new(),
    };
    made_scan(ctx, story, &frames, &document, READING..1.0)
}

/// What only a station can be asked for is refused by name.
fn refuse_station_fields(input: &ScanInput) -> Result<(), Problem> {
    let station_only = [
        ("from_mm", input.from_mm.is_some()),
        ("to_mm", input.to_mm.is_some()),
        ("step_mm", input.step_mm.is_some()),
        ("speed_mm_s", input.speed_mm_s.is_some()),
        ("mode", input.mode.is_some()),
        ("exposure_us", input.exposure_us.is_some()),
        ("laser_power", input.laser_power.is_some()),
        ("keep_frames", input.keep_frames),
        ("resume_scan_id", input.resume_scan_id.is_some()),
    ];
    match station_only.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((field, _)) => Err(Problem::new(
            ProblemKind::Impossible,
            format!("a capture's frames are taken already: {field} cannot be chosen"),
        )
        .at(format!("/{field}"))
        .remedy("leave it out, or scan from the station")),
    }
}

/// The scan that was named, or the only one there is.
fn chosen_scan(capture: &Capture, named: Option<&str>) -> Result<String, Problem> {
    let scans = &capture.manifest.scans;
    match (named, scans.as_slice()) {
        (Some(name), _) => Ok(capture.scan(name)?.name.clone()),
        (None, [only]) => Ok(only.name.clone()),
        (None, []) => Err(Problem::new(ProblemKind::Impossible, "the capture holds no scan")
            .remedy("name a capture with a scan; this one serves a calibration")),
        (None, several) => {
            let names: Vec<&str> = several.iter().map(|scan| scan.name.as_str()).collect();
            let detail = format!("the capture holds {} scans: {}", names.len(), names.join(", "));
            Err(Problem::new(ProblemKind::Impossible, detail).at("/source/scan").remedy("name one of them"))
        }
    }
}
