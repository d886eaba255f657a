//! The calibration procedure: camera, labels, comparison of light models, joint refinement, stage, report.

use nalgebra::Vector2;
use optics::{BoardFrame, CAMERA_PARAMETERS, Calibration, DepthRangeMm, LightModelKind, LightSurfaces, PointMm};

use crate::error::CalibrationError;
use crate::findings::report::{CalibrationReport, CrossValidation};
use crate::first::camera_fit::{CameraFit, fit_camera};
use crate::fits::cross_validation::cross_validate;
use crate::fits::joint::{JointFit, axis_of, axis_warnings, fit_joint};
use crate::fits::laser_points::{LaserPoints, laser_points};
use crate::fits::light_fit::Scene;
use crate::fits::stage_fit::{check_kinds, check_positions, positions_mm, stage_line, stage_report};
use crate::input::{CalibrationInput, CalibrationOptions, LightModelChoice};
use crate::params::MIN_LASER_POSES;
use crate::reporting::{axis_section, camera_report, light_report, stage_section};
use crate::solving::normal::Derived;
use crate::solving::observation::{CornerObservation, CornerView};

/// A calibration with its report.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationResult {
    /// The calibrated station; `light` holds no planes for a camera-only calibration.
    pub calibration: Calibration,
    /// Residuals, covariance, cross-validation.
    pub report: CalibrationReport,
}

/// Whether the computation continues.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProgressControl {
    /// Continue.
    Continue,
    /// Stop with [`CalibrationError::Cancelled`].
    Cancel,
}

/// Calibrates a station.
///
/// `progress` receives the current step as text for the operator and the fraction done, and may cancel. Without laser
/// images only the camera (and stage) is calibrated.
///
/// # Errors
/// [`CalibrationError`] with the quantity that the data do not determine.
pub fn calibrate(
    input: &CalibrationInput,
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(&str, f64) -> ProgressControl,
) -> Result<CalibrationResult, CalibrationError> {
    let mut step = |words: &str, done: f64| match progress(words, done) {
        ProgressControl::Continue => Ok(()),
        ProgressControl::Cancel => Err(CalibrationError::Cancelled),
    };
    check_orders(&input.projector.orders)?;
    step("fitting the camera", 0.0)?;
    check_kinds(&input.stage_views)?;
    let positions = positions_mm(&input.stage_views);
    check_positions(&positions, input.board.square_mm.min())?;
    let camera_fit = fit_camera(input.width_px, input.height_px, views(input), options.estimate_k3)?;
    let n_laser_poses = input.poses.iter().filter(|pose| pose.has_laser_image()).count();
    if n_laser_poses == 0 {
        return camera_only(input, camera_fit, &positions);
    }
    if n_laser_poses < MIN_LASER_POSES {
        return Err(CalibrationError::TooFewLaserPoses { needed: MIN_LASER_POSES, got: n_laser_poses });
    }
    step("finding the order of every line", 0.2)?;
    let scene = Scene {
        camera: &camera_fit.station.camera,
        poses: &camera_fit.station.poses,
        orders: &input.projector.orders,
        nominal_wavelength_over_period: input.projector.grating.map(|grating| grating.wavelength_over_period()),
    };
    let points = laser_points(input, &scene)?;
    step("comparing the light models on poses left out", 0.35)?;
    let comparison = cross_validate(&scene, &points.observations);
    let model = chosen(options.light_model, &comparison)?;
    step("refining camera, boards, light and stage together", 0.7)?;
    let joint = fit_joint(input, &camera_fit, &scene, &points, model)?;
    step("writing the report", 0.95)?;
    Ok(finish(input, &camera_fit, points, comparison, joint))
}

fn check_orders(orders: &[i8]) -> Result<(), CalibrationError> {
    let rising = orders.windows(2).all(|pair| pair[0] < pair[1]);
    let falling = orders.windows(2).all(|pair| pair[0] > pair[1]);
    if orders.is_empty() || !(rising || falling) {
        return Err(CalibrationError::OrdersUnsorted { orders: orders.to_vec() });
    }
    Ok(())
}

/// One view per image, poses first; view i is block i.
fn views(input: &CalibrationInput) -> Vec<CornerView> {
    let at_rest = input.poses.iter().map(|pose| (&pose.corners, 0.0));
    let carried = input.stage_views.iter().map(|view| (&view.corners, view.position.mm().unwrap_or(0.0)));
    at_rest
        .chain(carried)
        .enumerate()
        .map(|(block, (corners, travel_mm))| CornerView {
            block,
            travel_mm,
            corners: corners
                .corners
                .iter()
                .map(|corner| CornerObservation {
                    board_mm: input.board.corner_mm(corner.column, corner.row),
                    pixel: Vector2::new(corner.u_px, corner.v_px),
                    sigma_px: corner.sigma_px,
                })
                .collect(),
        })
        .collect()
}

fn chosen(choice: LightModelChoice, comparison: &CrossValidation) -> Result<LightModelKind, CalibrationError> {
    let kind = match choice {
        LightModelChoice::Auto => comparison.recommended,
        LightModelChoice::Fixed(kind) => kind,
    };
    let refused = |reason| Err(CalibrationError::LightModel { model: kind.name(), reason });
    match comparison.scores.iter().find(|score| score.model == kind) {
        Some(score) => score.failure.clone().map_or(Ok(kind), refused),
        None => refused("without a grating the lines are independent".to_owned()),
    }
}

fn camera_only(
    input: &CalibrationInput,
    fit: CameraFit,
    positions_mm: &[f64],
) -> Result<CalibrationResult, CalibrationError> {
    let board_centre_mm = input.board.centre_mm();
    let line = stage_line(&fit, positions_mm, &board_centre_mm);
    let poses = &fit.station.poses;
    let direction = line.as_ref().map(|line| line.derived(CAMERA_PARAMETERS, poses, &board_centre_mm));
    let turn = axis_of(input, poses, &fit.normal, &board_centre_mm)?;
    let axis = turn.as_ref().map(|turn| turn.derived(CAMERA_PARAMETERS, poses.len()));
    let derived = direction.or(axis).unwrap_or(Derived::none(CAMERA_PARAMETERS));
    let covariance = fit.normal.with_derived(&fit.covariance, &derived);
    let calibration = Calibration {
        id: String::new(),
        camera: fit.station.camera,
        orders: input.projector.orders.clone(),
        light: LightSurfaces::Planes(Vec::new()),
        stage: line
            .as_ref()
            .map(|line| line.axis(line.direction).into())
            .or(turn.as_ref().map(|turn| turn.axis.into())),
        depth_range_mm: board_depths(input, &fit),
        covariance: covariance.ok_or(CalibrationError::CameraUnobservable)?,
    };
    let stage = line.as_ref().map(|line| {
        let n = CAMERA_PARAMETERS;
        stage_report(line, &line.direction, &calibration.covariance.fixed_view::<3, 3>(n, n).into_owned())
    });
    let mut warnings = vec!["no laser images: only camera and stage were calibrated".to_owned()];
    warnings.extend(turn.iter().flat_map(axis_warnings));
    let report = CalibrationReport {
        camera: camera_report(input, &fit, &fit.station, &fit.views, &fit.covariance),
        light: None,
        cross_validation: None,
        stage,
        axis: turn.as_ref().map(|turn| axis_section(turn, &calibration.covariance)),
        warnings,
    };
    Ok(CalibrationResult { calibration, report })
}

/// Depths of all board corners at rest.
fn board_depths(input: &CalibrationInput, fit: &CameraFit) -> DepthRangeMm {
    let mut range = DepthRangeMm { near_mm: f64::INFINITY, far_mm: 0.0 };
    let used = if input.poses.is_empty() { &fit.views[..] } else { &fit.views[..input.poses.len()] };
    for view in used {
        for corner in &view.corners {
            let seen = fit.station.pose_of(view) * PointMm::<BoardFrame>::new(corner.board_mm);
            range.near_mm = range.near_mm.min(seen.xyz.z);
            range.far_mm = range.far_mm.max(seen.xyz.z);
        }
    }
    range
}

fn finish(
    input: &CalibrationInput,
    camera_fit: &CameraFit,
    points: LaserPoints,
    comparison: CrossValidation,
    joint: JointFit,
) -> CalibrationResult {
    let light = joint.station.light.clone().unwrap_or(LightSurfaces::Planes(Vec::new()));
    let calibration = Calibration {
        id: String::new(),
        camera: joint.station.camera,
        orders: input.projector.orders.clone(),
        light,
        stage: (joint.station.stage.zip(joint.stage_line.as_ref()))
            .map(|(direction, line)| line.axis(direction).into())
            .or(joint.turn.as_ref().map(|turn| turn.axis.into())),
        depth_range_mm: points.depth_range_mm,
        covariance: joint.covariance.clone(),
    };
    let n = CAMERA_PARAMETERS;
    let camera_covariance = joint.covariance.view((0, 0), (n, n)).into_owned();
    let stage = stage_section(&joint);
    let mut warnings = joint.warnings.clone();
    warnings.extend(points.warnings.iter().cloned());
    let report = CalibrationReport {
        camera: camera_report(input, camera_fit, &joint.station, &joint.views, &camera_covariance),
        light: Some(light_report(input, &calibration, &joint, &points)),
        cross_validation: Some(comparison),
        stage,
        axis: joint.turn.as_ref().map(|turn| axis_section(turn, &joint.covariance)),
        warnings,
    };
    CalibrationResult { calibration, report }
}
