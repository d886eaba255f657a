//! The joint refinement of the chosen model: camera, boards, light and stage against all pixels together.

use nalgebra::{DMatrix, Vector3};
use optics::calibration::STAGE_PARAMETERS;
use optics::{CAMERA_PARAMETERS, LightModelKind, LightSurfaces, Rigid};

use crate::error::CalibrationError;
use crate::first::camera_fit::{CameraFit, residuals};
use crate::fits::axis_fit::{AxisFit, RotaryView, axis_fit};
use crate::fits::laser_points::LaserPoints;
use crate::fits::light_fit::{LightFit, Scene, fit_light, light_priors, lit_points, scaled_to_residuals};
use crate::fits::stage_fit::{StageLine, positions_mm, stage_line, straight_line};
use crate::input::CalibrationInput;
use crate::params::{
    GAP_PRIOR_MM, PURE_ROTATION_MAX_NOISE_RATIO, STRAIGHT_STAGE_MAX_NOISE_RATIO, UNDETERMINED_PRIOR_FRACTION,
};
use crate::solving::bundle::Bundle;
use crate::solving::bundle_state::{BoardPose, BundleState};
use crate::solving::normal::{ArrowNormal, Derived};
use crate::solving::observation::{CornerView, LaserObservation};
use crate::solving::prior::Priors;
use crate::solving::solver::{Minimum, Problem, Termination, minimise};

/// The refined station.
#[derive(Debug, Clone)]
pub struct JointFit {
    /// Camera, light, stage, one pose per block.
    pub station: BundleState,
    /// The views used in the fit.
    pub views: Vec<CornerView>,
    /// Covariance of camera, light and stage parameters.
    pub covariance: DMatrix<f64>,
    /// The unconstrained line through the stage views, if there are any.
    pub stage_line: Option<StageLine>,
    /// The rotation fitted to the stage views of a turntable, if there are any.
    pub turn: Option<AxisFit>,
    /// Termination reason of the last fit.
    pub termination: Termination,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// Refines all parameters together. With the plane models, camera and boards keep their values from the corners alone:
/// the model error must not bias the camera.
///
/// # Errors
/// [`CalibrationError::LightModel`] if the data do not determine the model, [`CalibrationError::NotConverged`] without
/// convergence.
pub fn fit_joint(
    input: &CalibrationInput,
    camera_fit: &CameraFit,
    scene: &Scene,
    points: &LaserPoints,
    model: LightModelKind,
) -> Result<JointFit, CalibrationError> {
    let light = fit_light(scene, &points.observations, model, None)?.light;
    let n_poses = input.poses.len();
    let positions = positions_mm(&input.stage_views);
    let board_centre_mm = input.board.centre_mm();
    let line = stage_line(camera_fit, &positions, &board_centre_mm);
    let mut warnings = Vec::new();
    let start = Refinement { input, camera_fit, scene, points, n_poses, light, board_centre_mm };
    if line.is_some() {
        let (fit, ratio) = start.solve(true, &positions, model, &line)?;
        if ratio <= STRAIGHT_STAGE_MAX_NOISE_RATIO {
            return Ok(with_warnings(fit, warnings));
        }
        warnings.push(format!(
            "the stage does not travel straight: the corners in its views deviate from straight travel by {ratio:.1} times \
             their noise; its direction is the mean over the travel"
        ));
    }
    let (fit, _) = start.solve(false, &positions, model, &line)?;
    Ok(with_warnings(fit, warnings))
}

fn with_warnings(mut fit: JointFit, mut warnings: Vec<String>) -> JointFit {
    warnings.append(&mut fit.warnings);
    fit.warnings = warnings;
    fit
}

struct Refinement<'a> {
    input: &'a CalibrationInput,
    camera_fit: &'a CameraFit,
    scene: &'a Scene<'a>,
    points: &'a LaserPoints,
    n_poses: usize,
    light: LightSurfaces,
    board_centre_mm: Vector3<f64>,
}

impl Refinement<'_> {
    /// Refines with the stage views on one straight line or as free poses; also returns the ratio of the stage views'
    /// corner residuals to their noise.
    fn solve(
        &self,
        straight: bool,
        positions_mm: &[f64],
        model: LightModelKind,
        line: &Option<StageLine>,
    ) -> Result<(JointFit, f64), CalibrationError> {
        let undetermined = || CalibrationError::LightModel {
            model: model.name(),
            reason: "the joint refinement leaves its parameters undetermined".to_owned(),
        };
        let joint_light = model == LightModelKind::Grating;
        let (mut station, views) = self.start(straight, positions_mm);
        let mut priors = Priors { camera: self.camera_fit.priors.camera.clone(), ..Priors::default() };
        let mut laser: Vec<LaserObservation> = Vec::new();
        if joint_light {
            let points = lit_points(self.scene, &self.points.observations);
            let light_only = light_priors(self.scene, &self.light, &points);
            priors = Priors { camera: priors.camera, ..light_only };
            station.light = Some(self.light.clone());
            laser = self.points.observations.clone();
        }
        let mut free = self.camera_fit.free.clone();
        free.resize(station.globals(), true);
        let bundle = Bundle::new(views.clone(), laser, free.clone(), true, priors, station.poses.len());
        let minimum: Minimum<BundleState> = minimise(&bundle, station).ok_or_else(undetermined)?;
        if minimum.termination == Termination::NotConverged {
            return Err(CalibrationError::NotConverged {
                fit: "refinement of camera, boards, light and stage together",
            });
        }
        let mut station = minimum.state;
        let normal = bundle.linearise(&station);
        let covariance = normal.global_covariance(&free).ok_or_else(undetermined)?;
        let ratio = self.stage_noise_ratio(&station, &views);
        let (mut derived, mut termination) = (Derived::none(covariance.nrows()), minimum.termination);
        if !joint_light {
            let (light, of_light) = self.light_alone(&station)?;
            derived = derived.and(&of_light);
            (station.light, termination) = (Some(light.light), light.termination);
        }
        let free_line = line.as_ref().filter(|_| !straight);
        if let Some(line) = free_line {
            derived = derived.and(&line.derived(covariance.nrows(), &station.poses, &self.board_centre_mm));
            station.stage = Some(line.direction);
        }
        let turn = axis_of(self.input, &station.poses, &normal, &self.board_centre_mm)?;
        if let Some(turn) = &turn {
            derived = derived.and(&turn.derived(covariance.nrows(), station.poses.len()));
        }
        let mut covariance = normal.with_derived(&covariance, &derived).ok_or_else(undetermined)?;
        if let (true, Some(line)) = (straight, line) {
            let n_light = if joint_light { 0 } else { station.light_parameters() };
            covariance = with_stage_last(&covariance, n_light);
            let start = covariance.nrows() - STAGE_PARAMETERS;
            let mut stage = covariance.fixed_view_mut::<STAGE_PARAMETERS, STAGE_PARAMETERS>(start, start);
            stage += line.straightness_covariance();
        }
        let mut warnings = undetermined_parameters(&station, &covariance);
        warnings.extend(turn.iter().flat_map(axis_warnings));
        let stage_line = line.clone();
        Ok((JointFit { station, views, covariance, stage_line, turn, termination, warnings }, ratio))
    }

    /// Initial poses and views; a straight stage shares one pose block over all its views.
    fn start(&self, straight: bool, positions_mm: &[f64]) -> (BundleState, Vec<CornerView>) {
        let free = &self.camera_fit.station;
        let mut views = self.camera_fit.views.clone();
        let mut poses = free.poses.clone();
        let origins: Vec<Vector3<f64>> = poses[self.n_poses..].iter().map(|pose| pose.translation_mm).collect();
        let mut stage = None;
        if let (true, Some((origin_mm, direction, _))) = (straight, straight_line(&origins, positions_mm)) {
            let carried = Rigid::new(poses[self.n_poses].rotation, origin_mm);
            poses.truncate(self.n_poses);
            poses.push(carried);
            stage = Some(direction);
            for view in &mut views[self.n_poses..] {
                view.block = self.n_poses;
            }
        } else {
            for view in &mut views {
                view.travel_mm = 0.0;
            }
        }
        (BundleState { camera: free.camera, light: None, stage, poses }, views)
    }

    /// The light of a plane model in the refined scene, and its dependence on camera and boards; its own covariance is
    /// estimated from its residuals.
    fn light_alone(&self, station: &BundleState) -> Result<(LightFit, Derived), CalibrationError> {
        let scene = Scene { camera: &station.camera, poses: &station.poses, ..*self.scene };
        let laser = &self.points.observations;
        let fitted = fit_light(&scene, laser, self.light.kind(), Some(&self.light))?;
        let light = &fitted.light;
        let with_light = BundleState { light: Some(light.clone()), stage: None, ..station.clone() };
        let free = vec![true; with_light.globals()];
        let priors = light_priors(&scene, light, &[]);
        let scaled = scaled_to_residuals(&scene, light, laser);
        let bundle = Bundle::new(Vec::new(), scaled, free, true, priors, station.poses.len());
        let derived = bundle.linearise(&with_light).last_globals(CAMERA_PARAMETERS).ok_or_else(|| {
            CalibrationError::LightModel {
                model: light.kind().name(),
                reason: "the points leave its parameters undetermined".to_owned(),
            }
        })?;
        let n_stage = station.globals() - station.light_parameters() - CAMERA_PARAMETERS;
        let by_globals = derived.by_globals.resize_horizontally(CAMERA_PARAMETERS + n_stage, 0.0);
        Ok((fitted, Derived { by_globals, ..derived }))
    }

    /// RMS of corner residuals over σ in the stage views, relative to the board's degrees of freedom.
    fn stage_noise_ratio(&self, station: &BundleState, views: &[CornerView]) -> f64 {
        let (mut sum, mut n) = (0.0, 0usize);
        for (view, sigma, error) in residuals(station, views) {
            if view >= self.n_poses {
                sum += error.norm_squared() / (sigma * sigma);
                n += 2;
            }
        }
        (sum / n.max(1) as f64).sqrt()
    }
}

/// The axis of a turntable from the stage views, which are the last poses; `None` without views of one.
pub fn axis_of(
    input: &CalibrationInput,
    poses: &[BoardPose],
    normal: &ArrowNormal,
    board_centre_mm: &Vector3<f64>,
) -> Result<Option<AxisFit>, CalibrationError> {
    let first_view = poses.len().saturating_sub(input.stage_views.len());
    let mut views = Vec::new();
    for (idx, view) in input.stage_views.iter().enumerate() {
        let Some(angle_deg) = view.position.deg() else { continue };
        let block = first_view + idx;
        let noise = normal.block_covariance(block).ok_or(CalibrationError::CameraUnobservable)?;
        views.push(RotaryView { name: view.name.clone(), angle_deg, pose: poses[block], noise });
    }
    if views.is_empty() {
        return Ok(None);
    }
    axis_fit(&views, board_centre_mm, input.angle_sigma_deg).map(Some)
}

/// Warnings about a turntable.
pub fn axis_warnings(turn: &AxisFit) -> Vec<String> {
    let mut warnings = Vec::new();
    if turn.noise_ratio() > PURE_ROTATION_MAX_NOISE_RATIO {
        warnings.push(format!(
            "the turntable does not rotate about a fixed axis: its boards deviate from a pure rotation by {:.1} times their noise; \
             the covariance of the axis is widened by that factor",
            turn.noise_ratio()
        ));
    }
    if turn.axis.angle_error.is_none() {
        warnings.push(
            "the angular accuracy of the turntable is unknown: state stage.angle_sigma_deg, or add stage views; until then no verdict is possible"
                .to_owned(),
        );
    }
    warnings
}

/// Reorders a covariance of camera, stage and light to camera, light and stage: the last `n_light` parameters move up.
fn with_stage_last(covariance: &DMatrix<f64>, n_light: usize) -> DMatrix<f64> {
    let n = covariance.nrows();
    let (camera, light) = (CAMERA_PARAMETERS, CAMERA_PARAMETERS + n_light);
    let before = |idx: usize| match idx {
        _ if n_light == 0 || idx < camera => idx,
        _ if idx < light => idx + STAGE_PARAMETERS,
        _ => idx - n_light,
    };
    DMatrix::from_fn(n, n, |i, j| covariance[(before(i), before(j))])
}

/// Warnings about grating parameters that are determined by their prior instead of the data.
fn undetermined_parameters(station: &BundleState, covariance: &DMatrix<f64>) -> Vec<String> {
    let Some(LightSurfaces::Grating(grating)) = &station.light else { return Vec::new() };
    let gap = CAMERA_PARAMETERS + 8;
    let sigma_mm = covariance[(gap, gap)].sqrt();
    if sigma_mm <= UNDETERMINED_PRIOR_FRACTION * GAP_PRIOR_MM.1 {
        return Vec::new();
    }
    vec![format!(
        "the distance between laser and grating is not determined by the data ({:.0} ± {sigma_mm:.0} mm): \
         the field is narrow; depth is not affected within it",
        grating.gap_mm
    )]
}
