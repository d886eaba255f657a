//! `sheaf calibrate`: a capture folder to a calibration document, a table and a report.

use std::path::Path;

use calibration::document::InputHash;
use calibration::{CalibrationDocument, CalibrationOptions, CalibrationResult, LightModelChoice, Stop, calibrate};
use capture::{Capture, sha256_of};
use rayon::prelude::*;
use serde_json::json;

use crate::cli::CalibrateArgs;
use crate::commands::Answer;
use crate::failure::Failure;
use crate::features::{Features, calibration_features};
use crate::output::write_file;
use crate::progress::Reporter;
use crate::report;
use crate::tables::{calibration_json, calibration_text};

/// Calibrates and writes the document, then the report if asked for.
pub fn run(args: &CalibrateArgs, reporter: &Reporter) -> Result<Answer, Failure> {
    let capture = open_capture(&args.capture, reporter)?;
    let options = CalibrationOptions {
        light_model: args.light_model.kind().map_or(LightModelChoice::Auto, LightModelChoice::Fixed),
        estimate_k3: args.k3.estimate(),
    };
    let features = read_features(&capture, args.leave_out_unreadable, reporter)?;
    let Calibrated { result, document } = calibrate_features(&capture, &features, &options, reporter)?;
    write_file(&args.output, document.to_json().as_bytes())?;
    if let Some(path) = &args.report {
        let html = report::calibration_page(&capture, &features, &result, &document)?;
        write_file(path, html.as_bytes())?;
    }
    let mut text = calibration_text(&result, &document.calibration.id);
    text.push_str(&format!("\ncalibration {} → {}\n", document.calibration.id, args.output.display()));
    if let Some(path) = &args.report {
        text.push_str(&format!("report → {}\n", path.display()));
    }
    let mut json = calibration_json(&result, &document.calibration.id);
    json["output"] = json!(args.output);
    json["report_file"] = json!(args.report);
    json["left_out"] = json!(features.left_out);
    Ok(Answer::done(text, json))
}

/// A calibrated capture.
pub struct Calibrated {
    /// Calibration and what it says about itself.
    pub result: CalibrationResult,
    /// The document of the result.
    pub document: CalibrationDocument,
}

/// Opens a capture and passes its oddities on.
pub fn open_capture(folder: &Path, reporter: &Reporter) -> Result<Capture, Failure> {
    let capture = Capture::open(folder)?;
    for warning in &capture.warnings {
        reporter.warn(warning);
    }
    Ok(capture)
}

/// Reads the pictures of the calibration and names those that were left out.
pub fn read_features(
    capture: &Capture,
    leave_out_unreadable: bool,
    reporter: &Reporter,
) -> Result<Features, Failure> {
    let features = calibration_features(capture, leave_out_unreadable, reporter)?;
    for picture in &features.left_out {
        reporter.warn(&format!("left out: {picture}"));
    }
    Ok(features)
}

/// Calibrates what was read from the pictures.
pub fn calibrate_features(
    capture: &Capture,
    features: &Features,
    options: &CalibrationOptions,
    reporter: &Reporter,
) -> Result<Calibrated, Failure> {
    let task = reporter.fraction("calibrating");
    let result = calibrate(&features.input, options, &mut |step, fraction| {
        task.at(step, fraction);
        Stop::Continue
    })
    .map_err(|error| Failure::from(error).in_file(&capture.manifest_path()))?;
    drop(task);
    for warning in &result.report.warnings {
        reporter.warn(warning);
    }
    let document = CalibrationDocument::new(&result, input_hashes(capture)?, env!("CARGO_PKG_VERSION"));
    Ok(Calibrated { result, document })
}

/// Manifest and calibration pictures by content.
fn input_hashes(capture: &Capture) -> Result<Vec<InputHash>, Failure> {
    let mut paths = vec![Path::new("capture.json").to_owned()];
    let manifest = &capture.manifest;
    for pose in &manifest.poses {
        paths.push(pose.board.clone());
        paths.extend(pose.laser.clone());
    }
    paths.extend(manifest.stage_views.iter().map(|view| view.board.clone()));
    paths
        .par_iter()
        .map(|path| {
            let sha256 = sha256_of(&capture.folder.join(path))?;
            Ok(InputHash { path: path.display().to_string(), sha256 })
        })
        .collect()
}
