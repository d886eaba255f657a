//! From a scan's frames to a cloud.

use std::path::Path;

use calibration::CalibrationDocument;
use capture::Capture;
use optics::{Calibration, StageKind};
use scanning::files::peaks::{PeaksHeader, PeaksWriter};
use scanning::files::{FileError, write_cloud_in_pieces};
use scanning::{
    Cloud, CloudFormat, CloudPoint, Evaluation, Frames, ScanError, ScanFrame, ScanParams, ScanReport, ScanResult,
    evaluate_scan,
};
use statistics::median;

use crate::failure::Failure;
use crate::images::features::{scan_centrelines, stage_position};
use crate::progress::Reporter;
use crate::provenance::embed;

/// Evaluates one scan of the capture; the cloud contains its calibration.
pub fn scan_capture(
    capture: &Capture,
    document: &CalibrationDocument,
    name: &str,
    reporter: &dyn Reporter,
) -> Result<ScanResult, Failure> {
    let frames = scan_frames_of(capture, document, name, reporter)?;
    scan_frames(&frames, document, name, reporter).map_err(|failure| failure.in_file(&capture.manifest_path()))
}

/// The frames of one scan of the capture, all in memory.
pub(crate) fn scan_frames_of(
    capture: &Capture,
    document: &CalibrationDocument,
    name: &str,
    reporter: &dyn Reporter,
) -> Result<Vec<ScanFrame>, Failure> {
    let mut frames = Vec::new();
    capture_frames(capture, document, name, reporter, |frame| {
        frames.push(frame);
        Ok(())
    })?;
    Ok(frames)
}

/// Writes the frames of one scan of the capture to the new file `path`, with only a few in memory.
pub fn write_capture_peaks(
    capture: &Capture,
    document: &CalibrationDocument,
    name: &str,
    path: &Path,
    reporter: &dyn Reporter,
) -> Result<(), Failure> {
    let camera = capture.manifest.camera;
    let header = PeaksHeader {
        width_px: camera.width_px as u32,
        height_px: camera.height_px as u32,
        line_direction: capture.manifest.projector.direction_of(0),
        stage: match capture.manifest.stage.kind {
            capture::StageKind::Linear => StageKind::Linear,
            capture::StageKind::Rotary => StageKind::Rotary,
        },
    };
    let mut peaks = PeaksWriter::create(path, &header)?;
    capture_frames(capture, document, name, reporter, |frame| {
        peaks.add(&frame, None).map_err(|error| Failure::unwritable(path, &error))
    })?;
    peaks.finish().map_err(|error| Failure::unwritable(path, &error))?;
    Ok(())
}

/// Passes the frames of one scan of the capture to `take` in order: the centrelines of every image and its stage
/// position. An image of a cross gives two frames, one for each line.
fn capture_frames(
    capture: &Capture,
    document: &CalibrationDocument,
    name: &str,
    reporter: &dyn Reporter,
    mut take: impl FnMut(ScanFrame) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let images = capture.manifest.camera;
    check_camera(images.width_px, images.height_px, &document.calibration().camera)
        .map_err(|failure| failure.in_file(&capture.manifest_path()).at_entry("camera"))?;
    let frames = &capture.scan(name)?.frames;
    scan_centrelines(capture, name, reporter, |image_idx, centrelines| {
        take(ScanFrame { centrelines, position: stage_position(frames[image_idx].position()) })
    })
}

/// Computes the cloud of a scan from the centrelines and positions of its frames; it contains its calibration.
pub fn scan_frames(
    frames: &[ScanFrame],
    document: &CalibrationDocument,
    name: &str,
    reporter: &dyn Reporter,
) -> Result<ScanResult, Failure> {
    let calibration = document.calibration();
    collected(evaluated_scan(&frames, document, &calibration, name, reporter)?)
}

/// All points of a scan in memory, for callers that need them together.
pub fn collected(evaluation: Evaluation) -> Result<ScanResult, Failure> {
    let mut points = Vec::with_capacity(evaluation.report.n_points);
    evaluation.for_each_frame(|of_frame| -> Result<(), ScanError> {
        points.extend_from_slice(of_frame);
        Ok(())
    })?;
    Ok(ScanResult { cloud: Cloud { points, comments: evaluation.comments }, report: evaluation.report })
}

/// A cloud that was written.
pub struct WrittenCloud {
    /// Median σ of its points.
    pub median_sigma_mm: f64,
    /// Its points, unless they are too many to be kept.
    pub points: Option<Vec<CloudPoint>>,
}

/// Writes the points of a scan to `path` as they are computed, and passes them to `also`; at most `keep_points` are
/// also kept in memory.
pub fn write_scan_cloud<E: From<FileError> + From<ScanError> + Send>(
    path: &Path,
    format: CloudFormat,
    evaluation: &Evaluation,
    keep_points: usize,
    mut also: impl FnMut(&[CloudPoint]) -> Result<(), E>,
) -> Result<WrittenCloud, E> {
    let n_points = evaluation.report.n_points;
    let mut kept = (n_points <= keep_points).then(|| Vec::with_capacity(n_points));
    let mut sigmas_mm: Vec<f32> = Vec::with_capacity(n_points);
    write_cloud_in_pieces(path, format, &evaluation.comments, n_points, |add| {
        evaluation.for_each_frame(|points| -> Result<(), E> {
            sigmas_mm.extend(points.iter().map(|point| point.sigma_mm));
            if let Some(kept) = &mut kept {
                kept.extend_from_slice(points);
            }
            also(points)?;
            add(points)
        })
    })?;
    Ok(WrittenCloud { median_sigma_mm: median_mm(sigmas_mm), points: kept })
}

/// Evaluates a scan without computing its points: they are computed frame by frame, and need not be in memory
/// together. `calibration`: that of the document.
pub fn evaluated_scan<'a>(
    frames: &'a dyn Frames,
    document: &CalibrationDocument,
    calibration: &'a Calibration,
    name: &str,
    reporter: &dyn Reporter,
) -> Result<Evaluation<'a>, Failure> {
    reporter.check_cancelled()?;
    let mut evaluation = evaluate_scan(frames, calibration, &ScanParams::default())?;
    if evaluation.report.n_points == 0 {
        return Err(no_points(name, &evaluation.report));
    }
    let labels = &evaluation.report.labels;
    let dark = labels.iter().filter(|of_frame| of_frame.is_empty()).count();
    if dark > 0 {
        reporter.warn(&format!("scan {name}: {dark} of {} frames show no laser line", labels.len()));
    }
    embed(&mut evaluation.comments, document, name);
    Ok(evaluation)
}

/// Checks that images of that size belong to the calibrated camera.
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

fn no_points(name: &str, report: &ScanReport) -> Failure {
    let what = match report.n_segments {
        0 => format!("scan {name}: no frame shows a laser line"),
        n_segments => format!(
            "scan {name}: none of {n_segments} line pieces gave a point ({} points dropped)",
            report.dropped.total_points()
        ),
    };
    Failure::unobservable(what)
        .at_entry(format!("scans \"{name}\""))
        .remedy("check laser and exposure, that the part is within the calibrated depth, and that the calibration is of this station")
}

/// The median of σ in mm, the upper one of two; 0 if empty.
pub fn median_mm(mut sigmas: Vec<f32>) -> f64 {
    median(&mut sigmas).map_or(0.0, f64::from)
}
