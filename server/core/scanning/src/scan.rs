//! Evaluation of a scan: labelling, triangulation, registration, checks.

use optics::{Calibration, DepthRangeMm, StagePosition, Triangulator};

use crate::checks::compare::Surfaces;
use crate::error::ScanError;
use crate::evaluation::Evaluation;
use crate::input::frames::{Frames, ScanFrame};
use crate::input::motions::FrameMotion;
use crate::label::reference_view;
use crate::label::{Travel, label_frames, lit_lines};
use crate::params::KEPT_POINTS;
use crate::points::cloud::Cloud;
use crate::points::profiles::Profiles;
use crate::report::ScanReport;

/// Settings of a scan; the defaults suit any station.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ScanParams {
    /// Depth range (z of the camera frame) of the part; by default the range of the calibration.
    pub depth_range_mm: Option<DepthRangeMm>,
}

/// Points and report of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanResult {
    /// The points in the part frame.
    pub cloud: Cloud,
    /// The report.
    pub report: ScanReport,
}

/// Computes the cloud of a scan, in the part frame, from its centrelines.
///
/// Labels: `label::label_frames`. Registration: the inverse of the part's motion (`optics::Motion`). σ of a point:
/// image noise and calibration covariance along its ray. Points that the surfaces of other orders contradict are
/// dropped and counted.
///
/// # Errors
/// [`ScanError`]; lines that cannot be labelled are not an error, they are counted in the report.
pub fn scan_cloud(
    frames: &[ScanFrame],
    calibration: &Calibration,
    params: &ScanParams,
) -> Result<ScanResult, ScanError> {
    let evaluation = evaluate_scan(&frames, calibration, params)?;
    let mut points = Vec::with_capacity(evaluation.report.n_points);
    evaluation.for_each_frame(|of_frame| -> Result<(), ScanError> {
        points.extend_from_slice(of_frame);
        Ok(())
    })?;
    let cloud = Cloud { points, comments: evaluation.comments };
    Ok(ScanResult { cloud, report: evaluation.report })
}

/// [`scan_cloud`] for scans that need not fit into memory: computes labels and checks, and leaves the points to be
/// computed frame by frame. The points and the report are identical to the last bit.
///
/// # Errors
/// As [`scan_cloud`], and [`ScanError::UnreadableFrame`].
pub fn evaluate_scan<'a>(
    frames: &'a dyn Frames,
    calibration: &'a Calibration,
    params: &ScanParams,
) -> Result<Evaluation<'a>, ScanError> {
    evaluate_keeping(frames, calibration, params, KEPT_POINTS)
}

/// [`evaluate_scan`] with the profiles of about `keep_points` points cached between steps; the result is the same.
///
/// # Errors
/// As [`evaluate_scan`].
pub fn evaluate_keeping<'a>(
    frames: &'a dyn Frames,
    calibration: &'a Calibration,
    params: &ScanParams,
    keep_points: usize,
) -> Result<Evaluation<'a>, ScanError> {
    let depth_range_mm = checked_depth_range(calibration, params)?;
    let motions = motions(frames, calibration, depth_range_mm)?;
    let triangulator = Triangulator::new(calibration.clone());
    let labels = label_frames(frames, &motions, &triangulator, depth_range_mm)?;
    let lit = lit_lines(frames, calibration)?;
    let travel = Travel::of(&motions, lit.as_deref());
    let reference_view = reference_view(&travel, calibration, depth_range_mm, labels.direction);
    let profiles = Profiles::new(frames, labels, (calibration, triangulator), depth_range_mm, keep_points);
    let surfaces = Surfaces::new(&profiles, &motions, &travel.order, reference_view)?;
    Evaluation::new(profiles, surfaces)
}

fn checked_depth_range(calibration: &Calibration, params: &ScanParams) -> Result<DepthRangeMm, ScanError> {
    let range = params.depth_range_mm.unwrap_or(calibration.depth_range_mm);
    if range.near_mm > 0.0 && range.near_mm < range.far_mm && range.far_mm.is_finite() {
        return Ok(range);
    }
    Err(ScanError::BadDepthRange { near_mm: range.near_mm, far_mm: range.far_mm })
}

/// The motion of the part in every frame.
fn motions(
    frames: &dyn Frames,
    calibration: &Calibration,
    depth_range_mm: DepthRangeMm,
) -> Result<Vec<FrameMotion>, ScanError> {
    if frames.n_frames() == 0 {
        return Err(ScanError::NoFrames);
    }
    let positions: Vec<StagePosition> = (0..frames.n_frames()).map(|frame| frames.position(frame)).collect();
    if let Some(frame) = positions.iter().position(|position| !position.value().is_finite()) {
        return Err(ScanError::BadPosition { frame });
    }
    let Some(stage) = calibration.stage else { return motions_without_stage(&positions, calibration) };
    let motion = |(frame, position): (usize, &StagePosition)| {
        FrameMotion::new(&stage, *position, depth_range_mm).ok_or_else(|| ScanError::OtherStage {
            calibration: calibration.id.clone(),
            calibrated: stage.kind().name(),
            frame,
            found: position.kind().name(),
        })
    };
    positions.iter().enumerate().map(motion).collect()
}

/// Without a calibrated stage the part must not have moved.
fn motions_without_stage(
    positions: &[StagePosition],
    calibration: &Calibration,
) -> Result<Vec<FrameMotion>, ScanError> {
    let values = positions.iter().map(|position| position.value());
    let low = values.clone().fold(f64::INFINITY, f64::min);
    let high = values.fold(f64::NEG_INFINITY, f64::max);
    if high > low {
        return Err(ScanError::NoStage {
            calibration: calibration.id.clone(),
            travel: positions[0].kind().position(high - low),
        });
    }
    Ok(vec![FrameMotion::at_rest(); positions.len()])
}
