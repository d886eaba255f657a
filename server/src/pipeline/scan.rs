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
    let frames = capture_frames(capture, document, name, reporter)?;
    scan_frames(&frames, document, name, reporter).map_err(|failure| failure.in_file(&capture.manifest_path()))
}

/// The frames of one scan of the capture: the centrelines of every picture, and where the stage stood.
pub fn capture_frames(
    capture: &Capture,
    document: &CalibrationDocument,
    name: &str,
    reporter: &Reporter,
) -> Result<Vec<ScanFrame>, Failure> {
    let images = capture.manifest.camera;
    check_camera(images.width_px, images.height_px, &document.calibration().camera)
        .map_err(|failure| failure.in_file(&capture.manifest_path()).at_entry("camera"))?;
    let centrelines = scan_centrelines(capture, name, reporter)?;
    let positions = capture.scan(name)?.frames.iter().map(|frame| frame.position_mm);
    let frame = |(centrelines, position_mm)| ScanFrame { centrelines, position_mm };
    Ok(centrelines.into_iter().zip(positions).map(frame).collect())
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

/// Whether images of that size are of the calibrated camera.
pub fn check_camera(width_px: usize, height_px: usize, camera: &optics::Camera) -> Result<(), Failure> {
    if (width_px, height_px) == (camera.width_px, camera.height_px) {
        return Ok(());
    }
    Err(Failure::bad_input(format!(
        "the images have {width_px}×{height_px} pixels, the calibration is for {}×{}",
        camera.width_px, camera.height_px
    ))
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
