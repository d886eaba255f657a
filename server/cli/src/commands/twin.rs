//! `sheaf twin`: the simulated station as a source of capture folders with known truth.

use std::ops::ControlFlow;
use std::path::Path;

use optics::StageKind;
use serde_json::json;
use twin::{CaptureRequest, ScanRequest, SceneKind, StationModel, StationShape, capture_folder};

use crate::arguments::{StationArgs, TwinAction, TwinArgs, TwinCaptureArgs};
use crate::commands::Answer;
use pipeline::Reporter;
use pipeline::{Failure, FailureKind, failure_of};

/// Travel between the frames of a scan at a field of ±100 mm.
const STEP_MM: f64 = 0.8;

/// Angle of a scan on a turntable: a turn, and what shows how well it closes.
const TURN_DEG: f64 = 375.0;

/// Dispatches.
pub fn run(args: &TwinArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    match &args.action {
        TwinAction::Capture(args) => capture(args, reporter),
    }
}

fn capture(args: &TwinCaptureArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    if args.frames == 0 {
        return Err(Failure::new(FailureKind::BadParameter, "--frames must be at least 1"));
    }
    let shape = shape_from(&args.station);
    let model = seeded(args.seed, &shape)?;
    let mut request = CaptureRequest::standard(&model);
    request.n_poses = args.poses;
    request.scans = args.scene.iter().map(|scene| scan(&model, (*scene).into(), args.frames)).collect();
    let n_images = record(&model, &request, &args.output, reporter)?;
    let scans: Vec<&str> = request.scans.iter().map(|scan| scan.name.as_str()).collect();
    let text = format!(
        "{n_images} images, scans {}, truth.json and truth-<scan>.csv → {}\n",
        scans.join(", "),
        args.output.display()
    );
    Ok(Answer::done(
        text,
        json!({ "output": args.output, "n_images": n_images, "scans": scans, "seed": args.seed }),
    ))
}

fn scan(model: &StationModel, part: SceneKind, n_frames: usize) -> ScanRequest {
    let step = match model.shape.stage {
        StageKind::Linear => STEP_MM * model.shape.field_scale().min(1.0),
        StageKind::Rotary => TURN_DEG / n_frames as f64,
    };
    ScanRequest { name: part.name().to_owned(), part, n_frames, step }
}

/// Renders a capture folder with progress; the number of images.
pub fn record(
    model: &StationModel,
    request: &CaptureRequest,
    folder: &Path,
    reporter: &dyn Reporter,
) -> Result<usize, Failure> {
    let n_frames: usize = request.scans.iter().map(|scan| scan.n_frames).sum();
    let n_images = 2 * request.n_poses + request.stage_positions.len() + n_frames;
    let task = reporter.count("rendering the station", "images", n_images);
    capture_folder(model, request, folder, &|_| {
        task.step();
        ControlFlow::Continue(())
    })
    .map_err(|error| failure_of(FailureKind::BadInput, &error))?;
    Ok(n_images)
}

/// The station of a seed.
pub fn seeded(seed: u64, shape: &StationShape) -> Result<StationModel, Failure> {
    StationModel::seeded(seed, shape).map_err(|error| failure_of(FailureKind::BadParameter, &error))
}

fn shape_from(args: &StationArgs) -> StationShape {
    let usual = StationShape::default();
    StationShape {
        width_px: args.width_px.unwrap_or(usual.width_px),
        height_px: args.height_px.unwrap_or(usual.height_px),
        bits: args.bits.unwrap_or(usual.bits),
        wavelength_nm: args.wavelength_nm.unwrap_or(usual.wavelength_nm),
        lines_per_mm: args.grating_lines_per_mm.unwrap_or(usual.lines_per_mm),
        orders: args.orders.clone().unwrap_or(usual.orders),
        stage: if args.rotary { StageKind::Rotary } else { usual.stage },
        line_direction: args.line_direction.map_or(usual.line_direction, Into::into),
        standoff_mm: args.standoff_mm.unwrap_or(usual.standoff_mm),
        field_half_width_mm: args.field_half_width_mm.unwrap_or(usual.field_half_width_mm),
        grating_tilt_rad: args.grating_tilt_deg.map_or(usual.grating_tilt_rad, f64::to_radians),
        wavelength_over_period_error: args
            .wavelength_over_period_error
            .unwrap_or(usual.wavelength_over_period_error),
        line_sigma_px: args.line_sigma_px.unwrap_or(usual.line_sigma_px),
        line_peak: args.line_peak.unwrap_or(usual.line_peak),
        focus_depth_mm: args.focus_depth_mm.unwrap_or(usual.focus_depth_mm),
        speckle_contrast: args.speckle_contrast.unwrap_or(usual.speckle_contrast),
        speckle_grain_px: args.speckle_grain_px.unwrap_or(usual.speckle_grain_px),
        ambient_levels: args.ambient_levels.unwrap_or(usual.ambient_levels),
    }
}
