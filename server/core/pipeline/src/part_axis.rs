//! The axis of a turntable, estimated from a scan of a part from all sides.

use calibration::{CalibrationDocument, InputHash};
use capture::{Capture, sha256_of};
use optics::stage::AngleError;
use optics::{RotaryAxis, Stage};
use remedy::Remedy as _;
use scanning::{PartAxis, PartAxisError, axis_from_part};

use crate::failure::Failure;
use crate::progress::Reporter;
use crate::scan::scan_frames_of;

/// Estimates the axis about which the surfaces of one scan coincide, and the calibration with it; `start`: an
/// approximate axis.
///
/// # Errors
/// [`Failure`]: the scan is of a linear stage, or its part does not determine the axis.
pub fn calibrate_axis(
    capture: &Capture,
    document: &CalibrationDocument,
    scan: &str,
    start: &RotaryAxis,
    reporter: &dyn Reporter,
) -> Result<(PartAxis, CalibrationDocument), Failure> {
    let frames = scan_frames_of(capture, document, scan, reporter)?;
    let found =
        axis_from_part(&&frames[..], &document.calibration(), start).map_err(|error| refused(scan, &error))?;
    let mut calibration = found.calibration.clone();
    if let (Some(sigma_deg), Some(Stage::Rotary(axis))) =
        (capture.manifest.stage.angle_sigma_deg, &mut calibration.stage)
    {
        axis.angle_error = AngleError::new(sigma_deg.to_radians());
    }
    let how = format!(
        "the axis was estimated from {} points of the part observed twice in scan \"{scan}\", not from board views",
        found.n_pairs
    );
    let inputs: Result<Vec<InputHash>, Failure> = capture
        .scan(scan)?
        .frames
        .iter()
        .map(|frame| {
            let sha256 = sha256_of(&capture.folder.join(&frame.image))?;
            Ok(InputHash { path: frame.image.display().to_string(), sha256 })
        })
        .collect();
    let document = document.with_stage_of(&calibration, &how, inputs?);
    Ok((found, document))
}

fn refused(scan: &str, error: &PartAxisError) -> Failure {
    let failure = Failure::unobservable(format!("scan {scan}: {error}")).at_entry(format!("scans \"{scan}\""));
    match error.remedy() {
        Some(remedy) => failure.remedy(remedy),
        None => failure,
    }
}
