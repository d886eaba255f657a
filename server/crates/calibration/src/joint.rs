//! The joint refinement of the chosen model: camera, boards, light and stage against all pixels at once.

use nalgebra::{DMatrix, Matrix3, Vector3};
use optics::{CAMERA_PARAMETERS, LightModelKind, LightSurfaces, Rigid};

use crate::bundle::Bundle;
use crate::camera_fit::{CameraFit, residuals};
use crate::error::CalibrationError;
use crate::input::CalibrationInput;
use crate::laser_points::LaserPoints;
use crate::light_fit::{Scene, fit_light, light_priors, lit_points, misfit};
use crate::observation::{CornerView, LaserObservation};
use crate::params::{GAP_PRIOR_MM, STRAIGHT_STAGE_MAX_NOISE_RATIO, UNDETERMINED_PRIOR_SHARE};
use crate::prior::Priors;
use crate::solver::{Minimum, Problem, minimise};
use crate::stage_fit::{StageLine, stage_line};
use crate::station::Station;

/// The refined station.
#[derive(Debug, Clone)]
pub struct JointFit {
    /// Camera, light, stage, one pose per block.
    pub station: Station,
    /// The pictures as they took part.
    pub views: Vec<CornerView>,
    /// Covariance of camera, light and stage parameters.
    pub covariance: DMatrix<f64>,
    /// The free line through the stage views, if there are any.
    pub stage_line: Option<StageLine>,
    /// Oddities in words.
    pub warnings: Vec<String>,
}

/// Refines everything. The plane models keep camera and boards as the corners alone have them: their misfit must
/// not bend the camera.
///
/// # Errors
/// [`CalibrationError::LightModel`] if the data leave the model undetermined.
pub fn fit_joint(
    input: &CalibrationInput,
    camera_fit: &CameraFit,
    scene: &Scene,
    points: &LaserPoints,
    model: LightModelKind,
) -> Result<JointFit, CalibrationError> {
    let light = fit_light(scene, &points.observations, model, None)?;
    let n_poses = input.poses.len();
    let positions: Vec<f64> = input.stage_views.iter().map(|view| view.position_mm).collect();
    let free_poses = &camera_fit.station.poses[n_poses..];
    let line = stage_line(free_poses, &positions, &input.board.centre_mm());
    let mut warnings = Vec::new();
    if line.is_none() && !positions.is_empty() {
        warnings.push("the stage is unobservable: its views are all at one position".to_owned());
    }
    let start = Refinement { camera_fit, scene, points, n_poses, light };
    if line.is_some() {
        let (fit, ratio) = start.solve(true, &positions, model, &line)?;
        if ratio <= STRAIGHT_STAGE_MAX_NOISE_RATIO {
            return Ok(with_warnings(fit, warnings));
        }
        warnings.push(format!(
            "the stage does not travel straight: corners of its views miss a straight travel by {ratio:.1} times \
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
    camera_fit: &'a CameraFit,
    scene: &'a Scene<'a>,
    points: &'a LaserPoints,
    n_poses: usize,
    light: LightSurfaces,
}

impl Refinement<'_> {
    /// Refines with the stage views on one straight travel or as free poses; also returns how far the corners of the
    /// stage views exceed their noise.
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
        let minimum: Minimum<Station> = minimise(&bundle, station).ok_or_else(undetermined)?;
        let mut station = minimum.state;
        let normal = bundle.linearise(&station);
        let mut covariance = normal.global_covariance(&free).ok_or_else(undetermined)?;
        if !joint_light {
            let (light, light_covariance) = self.light_alone(&station).ok_or_else(undetermined)?;
            covariance = with_light(&covariance, &light_covariance);
            station.light = Some(light);
        }
        let ratio = self.stage_noise_ratio(&station, &views);
        let mut warnings = undetermined_parameters(&station, &covariance);
        if let (false, Some(line)) = (straight, line) {
            station.stage = Some(line.direction);
            covariance = with_stage(&covariance, &line.covariance);
        }
        if !minimum.converged {
            warnings.push("the joint refinement stopped before it converged".to_owned());
        }
        Ok((JointFit { station, views, covariance, stage_line: line.clone(), warnings }, ratio))
    }

    /// Poses and views to start from; a straight stage shares one pose block over all its views.
    fn start(&self, straight: bool, positions_mm: &[f64]) -> (Station, Vec<CornerView>) {
        let free = &self.camera_fit.station;
        let mut views = self.camera_fit.views.clone();
        let mut poses = free.poses.clone();
        let origins = stage_line(&poses[self.n_poses..], positions_mm, &Vector3::zeros());
        let mut stage = None;
        if let (true, Some(origins)) = (straight, origins) {
            let carried = Rigid::new(poses[self.n_poses].rotation, origins.origin_mm);
            poses.truncate(self.n_poses);
            poses.push(carried);
            stage = Some(origins.direction);
            for view in &mut views[self.n_poses..] {
                view.block = self.n_poses;
            }
        } else {
            for view in &mut views {
                view.travel_mm = 0.0;
            }
        }
        (Station { camera: free.camera, light: None, stage, poses }, views)
    }

    /// The light of a plane model in the refined scene, with the covariance its own residuals show.
    fn light_alone(&self, station: &Station) -> Option<(LightSurfaces, DMatrix<f64>)> {
        let scene = Scene { camera: &station.camera, poses: &station.poses, ..*self.scene };
        let laser = &self.points.observations;
        let light = fit_light(&scene, laser, self.light.kind(), Some(&self.light)).ok()?;
        let with_light = Station { light: Some(light.clone()), stage: None, ..station.clone() };
        let mut free = vec![false; CAMERA_PARAMETERS];
        free.resize(with_light.globals(), true);
        let priors = light_priors(&scene, &light, &[]);
        let bundle = Bundle::new(Vec::new(), laser.clone(), free.clone(), false, priors, station.poses.len());
        let covariance = bundle.linearise(&with_light).global_covariance(&free)?;
        let n = light.parameters();
        let own = covariance.view((CAMERA_PARAMETERS, CAMERA_PARAMETERS), (n, n)).into_owned();
        Some((light.clone(), own * misfit(&scene, &light, laser)))
    }

    /// RMS of corner residuals over σ in the stage views, relative to the board's degrees of freedom.
    fn stage_noise_ratio(&self, station: &Station, views: &[CornerView]) -> f64 {
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

/// Camera–stage covariance with the light's own put between, uncorrelated.
fn with_light(covariance: &DMatrix<f64>, light: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, m, c) = (covariance.nrows(), light.nrows(), CAMERA_PARAMETERS);
    let place = |i: usize| if i < c { i } else { i + m };
    let mut whole = DMatrix::zeros(n + m, n + m);
    for i in 0..n {
        for j in 0..n {
            whole[(place(i), place(j))] = covariance[(i, j)];
        }
    }
    whole.view_mut((c, c), (m, m)).copy_from(light);
    whole
}

/// The covariance with an uncorrelated stage appended.
fn with_stage(covariance: &DMatrix<f64>, stage: &Matrix3<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    let mut whole = DMatrix::zeros(n + 3, n + 3);
    whole.view_mut((0, 0), (n, n)).copy_from(covariance);
    whole.view_mut((n, n), (3, 3)).copy_from(stage);
    whole
}

/// Words for the grating parameters that stayed where their prior put them.
fn undetermined_parameters(station: &Station, covariance: &DMatrix<f64>) -> Vec<String> {
    let Some(LightSurfaces::Grating(grating)) = &station.light else { return Vec::new() };
    let gap = CAMERA_PARAMETERS + 8;
    let sigma_mm = covariance[(gap, gap)].sqrt();
    if sigma_mm <= UNDETERMINED_PRIOR_SHARE * GAP_PRIOR_MM.1 {
        return Vec::new();
    }
    vec![format!(
        "the distance between laser and grating is not determined by the data ({:.0} ± {sigma_mm:.0} mm): \
         the field is narrow; depth is not affected within it",
        grating.gap_mm
    )]
}
