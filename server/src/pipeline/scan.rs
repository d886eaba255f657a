//! A scan's frames to a cloud.

use calibration::CalibrationDocument;
use capture::Capture;
use scanning::{ScanFrame, ScanParams, ScanResult, scan_cloud};

use crate::cloud_provenance::embed;
use crate::failure::Failure;
use crate::features::scan_centrelines;
use crate::progress::Reporter;

/// Scans one scan of the capture; the cloud carries its calibration.
pub fn scan_capture(
    capture: &Capture,
    document: &CalibrationDocument,
    name: &str,
    reporter: &Reporter,
) -> Result<ScanResult, Failure> {
    let calibration = document.calibration();
    check_camera(capture, &calibration.camera)?;
    let centrelines = scan_centrelines(capture, name, reporter)?;
    let positions = capture.scan(name)?.frames.iter().map(|frame| frame.position_mm);
    let frames: Vec<ScanFrame> = centrelines
        .into_iter()
        .zip(positions)
        .map(|(centrelines, position_mm)| ScanFrame { centrelines, position_mm })
        .collect();
    scan_frames(&frames, document, name, reporter).map_err(|failure| failure.in_file(&capture.manifest_path()))
}

/// Centrelines and positions of a scan's frames to a cloud that carries its calibration.
pub fn scan_frames(
    frames: &[ScanFrame],
    document: &CalibrationDocument,
    name: &str,
    reporter: &Reporter,
) -> Result<ScanResult, Failure> {
    reporter.go_on()?;
    let mut result = scan_cloud(frames, &document.calibration(), &ScanParams::default())?;
    if result.cloud.points.is_empty() {
        return Err(nothing_seen(name, &result));
    }
    let dark = frames.iter().filter(|frame| frame.centrelines.segments.is_empty()).count();
    if dark > 0 {
        reporter.warn(&format!("scan {name}: {dark} of {} frames show no laser line", frames.len()));
    }
    embed(&mut result.cloud, document, name);
    Ok(result)
}

fn check_camera(capture: &Capture, camera: &optics::Camera) -> Result<(), Failure> {
    let images = capture.manifest.camera;
    if (images.width_px, images.height_px) == (camera.width_px, camera.height_px) {
        return Ok(());
    }
    Err(Failure::bad_input(format!(
        "the capture's images have {}×{} pixels, the calibration is for {}×{}",
        images.width_px, images.height_px, camera.width_px, camera.height_px
    ))
    .in_file(&capture.manifest_path())
    .at_entry("camera")
    .remedy("use the calibration of this camera at this resolution"))
}

fn nothing_seen(name: &str, result: &ScanResult) -> Failure {
    let what = match result.report.n_segments {
        0 => format!("scan {name}: no frame shows a laser line"),
        n_segments => format!(
            "scan {name}: none of {n_segments} line pieces gave a point ({} points left out)",
            result.report.dropped.total_points()
        ),
    };
    Failure::unobservable(what)
        .at_entry(format!("scans \"{name}\""))
        .remedy("check laser and exposure, that the part is within the calibrated depth, and that the calibration is of this station")
}
