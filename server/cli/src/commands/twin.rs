//! `sheaf twin`: renders capture folders with ground truth on the simulated station.

use std::ops::ControlFlow;
use std::path::Path;

use optics::StageKind;
use serde_json::json;
use twin::{CaptureRequest, ScanRequest, SceneKind, StationModel, StationShape, capture_folder};

use crate::arguments::{StationArgs, TwinAction, TwinArgs, TwinCaptureArgs};
use crate::commands::Answer;
use pipeline::Reporter;
use pipeline::{Failure, FailureKind, failure_of};

/// Travel between the frames of a scan for a field of ±100 mm.
const STEP_MM: f64 = 0.8;

/// Angle of a scan on a turntable: a full turn and an overlap that shows its closure.
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

/// Renders a capture folder with progress; returns the number of images.
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

/// The station model for a seed.
pub fn seeded(seed: u64, shape: &StationShape) -> Result<StationModel, Failure> {
    StationModel::seeded(seed, shape).map_err(|error| failure_of(FailureKind::BadParameter, &error))
}

fn shape_from(args: &StationArgs) -> StationShape {
    let default = StationShape::default();
    StationShape {
        projector: default.projector,
        width_px: args.width_px.unwrap_or(default.width_px),
        height_px: args.height_px.unwrap_or(default.height_px),
        bits: args.bits.unwrap_or(default.bits),
        wavelength_nm: args.wavelength_nm.unwrap_or(default.wavelength_nm),
        lines_per_mm: args.grating_lines_per_mm.unwrap_or(default.lines_per_mm),
        orders: args.orders.clone().unwrap_or(default.orders),
        stage: if args.rotary { StageKind::Rotary } else { default.stage },
        line_direction: args.line_direction.map_or(default.line_direction, Into::into),
        standoff_mm: args.standoff_mm.unwrap_or(default.standoff_mm),
        field_half_width_mm: args.field_half_width_mm.unwrap_or(default.field_half_width_mm),
        grating_tilt_rad: args.grating_tilt_deg.map_or(default.grating_tilt_rad, f64::to_radians),
        wavelength_over_period_error: args
            .wavelength_over_period_error
            .unwrap_or(default.wavelength_over_period_error),
        line_sigma_px: args.line_sigma_px.unwrap_or(default.line_sigma_px),
        line_peak: args.line_peak.unwrap_or(default.line_peak),
        focus_depth_mm: args.focus_depth_mm.unwrap_or(default.focus_depth_mm),
        speckle_contrast: args.speckle_contrast.unwrap_or(default.speckle_contrast),
        speckle_grain_px: args.speckle_grain_px.unwrap_or(default.speckle_grain_px),
        ambient_levels: args.ambient_levels.unwrap_or(default.ambient_levels),
    }
}
