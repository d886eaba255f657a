//! From a capture to a calibration: images, features, fit, document.

use std::path::Path;

use calibration::document::InputHash;
use calibration::{CalibrationDocument, CalibrationOptions, CalibrationResult, ProgressControl, calibrate};
use capture::{Capture, ChannelBasis, sha256_of};
use rayon::prelude::*;

use crate::failure::Failure;
use crate::images::features::{Features, calibration_features};
use crate::progress::Reporter;

/// Result of the calibration of a capture.
pub struct Calibrated {
    /// Calibration with its report.
    pub result: CalibrationResult,
    /// The document of the result.
    pub document: CalibrationDocument,
}

/// Opens a capture, reports its warnings and the channel used for colour images.
pub fn open_capture(folder: &Path, reporter: &dyn Reporter) -> Result<Capture, Failure> {
    let capture = Capture::open(folder)?;
    for warning in &capture.warnings {
        reporter.warn(warning);
    }
    if capture.laser_channel().basis != ChannelBasis::GreyImages {
        reporter.note(&capture.laser_channel().to_string());
    }
    if !capture.white_level().is_full() {
        reporter.note(&format!("white level {}", capture.white_level().level()));
    }
    Ok(capture)
}

/// Extracts the features of the calibration images and reports the images left out.
pub fn read_features(
    capture: &Capture,
    leave_out_unreadable: bool,
    reporter: &dyn Reporter,
) -> Result<Features, Failure> {
    let features = calibration_features(capture, leave_out_unreadable, reporter)?;
    for image in &features.left_out {
        reporter.warn(&format!("left out: {image}"));
    }
    Ok(features)
}

/// Calibrates from the features of the images.
pub fn calibrate_features(
    capture: &Capture,
    features: &Features,
    options: &CalibrationOptions,
    reporter: &dyn Reporter,
) -> Result<Calibrated, Failure> {
    let task = reporter.fraction("calibrating");
    let result = calibrate(&features.input, options, &mut |step, fraction| {
        task.at(step, fraction);
        if reporter.check_cancelled().is_ok() { ProgressControl::Continue } else { ProgressControl::Cancel }
    })
    .map_err(|error| Failure::from(error).in_file(&capture.manifest_path()))?;
    drop(task);
    for warning in &result.report.warnings {
        reporter.warn(warning);
    }
    let document = CalibrationDocument::new(&result, input_hashes(capture)?, env!("CARGO_PKG_VERSION"));
    Ok(Calibrated { result, document })
}

/// Hashes of the manifest and the calibration images.
fn input_hashes(capture: &Capture) -> Result<Vec<InputHash>, Failure> {
    let mut paths = vec![Path::new("capture.json").to_owned()];
    let manifest = &capture.manifest;
    paths.extend(manifest.background.clone());
    for pose in &manifest.poses {
        paths.push(pose.board.clone());
        paths.extend(pose.laser.clone());
        paths.extend(pose.lasers.clone());
        paths.extend(pose.background.clone());
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
