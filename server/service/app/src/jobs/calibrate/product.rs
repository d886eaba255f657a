//! From a capture to the stored results: document, report, summary, record.

use crate::camera::correction::{CORRECTION, ImageDarkFrame, correction_json, different};
use crate::events::{CalibrationCreated, Event, event};
use std::ops::Range;

use calibration::{CalibrationOptions, CalibrationResult, LightModelChoice};
use capture::Capture;
use optics::LightModelKind;
use serde_json::{Value, json};
use station::DarkFrameUse;
use station::wall_clock::now_ms;
use store::{ArtifactId, CalibrationRecord, Change, ResultRef};

use crate::jobs::calibrate::CALIBRATION;
use crate::jobs::progress::Phase;
use crate::jobs::{CalibrateInput, ComputeContext, Done, JobEnd};
use crate::resources::calibrations::residuals::{RESIDUALS, Residuals};
use crate::resources::calibrations::used_station::STATION;
use crate::resources::inspections::utc;
use pipeline::Features;
use pipeline::{Calibrated, calibrate_features, read_features};
use report::tables::calibration_json;
use report::{ImageCorrection, UsedDarkFrame, calibration_page};

/// Fraction of the work for reading the images.
const READING: f64 = 0.6;

/// Share after which only writing remains.
const FITTING: f64 = 0.95;

/// Images of a calibration.
pub(super) struct CalibrationImages<'a> {
    /// The capture.
    pub capture: &'a Capture,
    /// Its id.
    pub capture_id: &'a str,
    /// Its name in the report.
    pub name: &'a str,
    /// The dark frame of each image; `None` if a stored capture is calibrated, whose images do not record it.
    pub dark_frames: Option<&'a [Option<ImageDarkFrame>]>,
}

/// Calibrates from `images`; `part` is the range of the job's progress that this covers.
pub(super) fn calibrated(
    images: &CalibrationImages<'_>,
    input: &CalibrateInput,
    ctx: &ComputeContext,
    part: Range<f64>,
) -> Result<Done, JobEnd> {
    let &CalibrationImages { capture, capture_id, name, dark_frames } = images;
    let at = |share: f64| part.start + (part.end - part.start) * share;
    let reading = ctx.reporter(Phase::ReadingImages, at(0.0)..at(READING));
    let features = read_features(capture, input.leave_out_unreadable, &reading)?;
    let fitting = ctx.reporter(Phase::Calibrating, at(READING)..at(FITTING));
    let Calibrated { result, document } = calibrate_features(capture, &features, &options(input), &fitting)?;
    ctx.report(at(FITTING), Phase::WritingReport, "writing the report");
    let page = calibration_page(capture, name, &features, &result, &document, dark_frames.map(reported).as_ref())?;
    ctx.check_cancelled()?;
    let id = document.calibration.id.clone();
    let mut summary = summary(&result, &features, &id);
    summary[RESIDUALS] = json!(keep_residuals(&result, ctx)?.as_str());
    if let Some(station) = &input.station {
        summary[STATION] = json!(station);
    }
    if let Some(dark_frames) = dark_frames {
        summary[CORRECTION] = correction_json(dark_frames);
    }
    let record = CalibrationRecord {
        id: id.clone(),
        document: ctx.wait(ctx.artifacts.put(document.to_json().as_bytes()))?,
        report: Some(ctx.wait(ctx.artifacts.put(page.as_bytes()))?),
        capture_id: Some(capture_id.to_owned()),
        job_id: Some(ctx.id.clone()),
        summary,
        created_at_ms: now_ms(),
    };
    let light = result.report.light.as_ref();
    let body = CalibrationCreated {
        job_id: ctx.id.clone(),
        model: light.map(|light| light.model.name().to_owned()),
        corner_rms_px: result.report.camera.rms_px,
        systematic_sigma_mm: light.map(|light| light.systematic_sigma_mm),
    };
    let created = event(&id, Event::CalibrationCreated(body));
    Ok(Done {
        result: ResultRef { kind: CALIBRATION.to_owned(), id },
        message: message(&result),
        changes: vec![Change::InsertCalibration(record), created],
        finished_work: None,
    })
}

/// The correction of the images, for the report.
fn reported(images: &[Option<ImageDarkFrame>]) -> ImageCorrection {
    let used = |dark_frame: &ImageDarkFrame| UsedDarkFrame {
        taken_at: utc(dark_frame.taken_at_ms),
        exposure_us: dark_frame.exposure_us,
        n_hot_pixels: dark_frame.n_hot_pixels,
        subtracts_pattern: dark_frame.used == DarkFrameUse::Full.name(),
        n_images: images.iter().flatten().filter(|of_image| *of_image == dark_frame).count(),
    };
    ImageCorrection { n_images: images.len(), dark_frames: different(images).into_iter().map(used).collect() }
}

/// Stores the points of the residual maps; the document contains only their statistics.
fn keep_residuals(result: &CalibrationResult, ctx: &ComputeContext) -> Result<ArtifactId, JobEnd> {
    let residuals = Residuals::of(&result.report, &result.calibration.camera);
    Ok(ctx.wait(ctx.artifacts.put(&residuals.to_stored()))?)
}

fn options(input: &CalibrateInput) -> CalibrationOptions {
    let fixed = LightModelKind::ALL.into_iter().find(|kind| input.light_model.as_deref() == Some(kind.name()));
    CalibrationOptions {
        light_model: fixed.map_or(LightModelChoice::Auto, LightModelChoice::Fixed),
        estimate_k3: match input.k3.as_deref() {
            Some("on") => Some(true),
            Some("off") => Some(false),
            _ => None,
        },
    }
}

/// Summary for lists and for comparing calibrations.
fn summary(result: &CalibrationResult, features: &Features, id: &str) -> Value {
    let full = calibration_json(result, id);
    let report = &result.report;
    let depth = result.calibration.depth_range_mm;
    json!({
        "corner_rms_px": report.camera.rms_px,
        "corner_sigma_px": report.camera.corner_sigma_px,
        "k3_reason": report.camera.k3_reason,
        "camera": full["camera"]["parameters"],
        "images": full["camera"]["images"],
        "model": report.light.as_ref().map(|light| light.model.name()),
        "light_rms_px": report.light.as_ref().map(|light| light.rms_px),
        "systematic_sigma_mm": report.light.as_ref().map(|light| light.systematic_sigma_mm),
        "models": full["models"],
        "n_poses": features.input.poses.len(),
        "n_laser_poses": features.input.poses.iter().filter(|pose| pose.centrelines.is_some()).count(),
        "n_stage_views": features.input.stage_views.len(),
        "depth_near_mm": depth.near_mm,
        "depth_far_mm": depth.far_mm,
        "stage": full["stage"],
        "axis": full["axis"],
        "warnings": report.warnings,
        "left_out": features.left_out,
    })
}

/// The final message for the operator.
fn message(result: &CalibrationResult) -> String {
    let corners = format!("corners within {:.3} px RMS", result.report.camera.rms_px);
    match &result.report.light {
        None => format!("camera calibrated, {corners}; without laser images it cannot be used for scanning"),
        Some(light) => format!(
            "calibrated with model {}, {corners}, depth within {:.1} µm; activate it to use it",
            light.model,
            light.systematic_sigma_mm * 1e3
        ),
    }
}
