//! Robust fit of the light sheets of any model with fixed camera and board poses, with residuals in the image.

use nalgebra::Vector3;
use optics::{CAMERA_PARAMETERS, Camera, LightModelKind, LightSurfaces};

use crate::error::CalibrationError;
use crate::first::first_sheets::{
    LitPoint, grating_from_pencil, lit_centre, pencil_from_planes, planes_from_points,
};
use crate::params::{MIN_RANKED_BOARDS, MIN_TIED_ORDERS};
use crate::solving::bundle::{Bundle, sheet_residual};
use crate::solving::bundle_state::{BoardPose, BundleState};
use crate::solving::observation::LaserObservation;
use crate::solving::prior::Priors;
use crate::solving::solver::{Minimum, Termination, minimise};

/// Fixed camera and poses for the fit of the light.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// One pose per block.
    pub poses: &'a [BoardPose],
    /// The listed orders.
    pub orders: &'a [i8],
    /// Nominal λ/d_g; `None` without a grating.
    pub nominal_wavelength_over_period: Option<f64>,
}

impl Scene<'_> {
    /// The possible models, simplest first: without a grating nothing relates the lines to each other.
    pub fn models(&self) -> &'static [LightModelKind] {
        match self.nominal_wavelength_over_period {
            Some(_) => &LightModelKind::ALL,
            None => &[LightModelKind::Planes],
        }
    }

    /// The model used to label lines and find outliers: the most exact one that this number of lines determines.
    pub fn working_model(&self) -> LightModelKind {
        match self.nominal_wavelength_over_period {
            Some(_) if self.orders.len() >= MIN_TIED_ORDERS => LightModelKind::Grating,
            _ => LightModelKind::Planes,
        }
    }
}

/// Light sheets and the termination reason of their fit.
#[derive(Debug, Clone, PartialEq)]
pub struct LightFit {
    /// The sheets.
    pub light: LightSurfaces,
    /// Never [`Termination::NotConverged`].
    pub termination: Termination,
}

/// Fits a model; `start` replaces the search for an initial estimate.
///
/// # Errors
/// [`CalibrationError::LightModel`] with the reason.
pub fn fit_light(
    scene: &Scene,
    laser: &[LaserObservation],
    kind: LightModelKind,
    start: Option<&LightSurfaces>,
) -> Result<LightFit, CalibrationError> {
    let refused = |reason: &str| CalibrationError::LightModel { model: kind.name(), reason: reason.to_owned() };
    let points = lit_points(scene, laser);
    let start = match start {
        Some(start) => start.clone(),
        None => first_light(scene, laser, &points, kind)?,
    };
    let priors = light_priors(scene, &start, &points);
    let scaled = scaled_to_residuals(scene, &start, laser);
    let minimum = minimise_light(scene, &scaled, start, priors);
    let undetermined = || refused("the points leave its parameters undetermined");
    let Minimum { state, termination, .. } = minimum.ok_or_else(undetermined)?;
    if termination == Termination::NotConverged {
        return Err(refused("its fit did not converge"));
    }
    Ok(LightFit { light: state.light.ok_or_else(undetermined)?, termination })
}

/// Improves an initial estimate by a fit with σ widened to its residuals. The finer the pixels, the larger is the bow,
/// which a flat estimate lacks, in units of their σ; if the points were treated as outliers, the fit would not move.
fn approached(
    scene: &Scene,
    laser: &[LaserObservation],
    points: &[LitPoint],
    guess: LightSurfaces,
) -> LightSurfaces {
    let priors = light_priors(scene, &guess, points);
    let minimum = minimise_light(scene, &widened(scene, &guess, laser), guess.clone(), priors);
    minimum.and_then(|minimum| minimum.state.light).unwrap_or(guess)
}

/// The points with σ widened to the residuals of the plane models, whose model error does not count as an outlier. The
/// exact model must fit within the points' own σ.
pub fn scaled_to_residuals(
    scene: &Scene,
    light: &LightSurfaces,
    laser: &[LaserObservation],
) -> Vec<LaserObservation> {
    match light.kind() {
        LightModelKind::Grating => laser.to_vec(),
        LightModelKind::Planes | LightModelKind::Pencil => widened(scene, light, laser),
    }
}

/// The points with σ widened to their residuals.
fn widened(scene: &Scene, light: &LightSurfaces, laser: &[LaserObservation]) -> Vec<LaserObservation> {
    let by = residual_ratio(scene, light, laser).sqrt();
    laser.iter().map(|point| LaserObservation { sigma_px: point.sigma_px * by, ..*point }).collect()
}

/// Mean square of residual over σ, at least 1: the ratio of a model's residuals to the points' noise.
fn residual_ratio(scene: &Scene, light: &LightSurfaces, laser: &[LaserObservation]) -> f64 {
    let squares: Vec<f64> = laser
        .iter()
        .filter_map(|p| sheet_residual(scene.camera, light, &scene.poses[p.block], p, None).map(|s| (s, p)))
        .map(|(sheet, point)| (sheet.residual_px / point.sigma_px).powi(2))
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).max(1.0)
}

fn minimise_light(
    scene: &Scene,
    laser: &[LaserObservation],
    start: LightSurfaces,
    priors: Priors,
) -> Option<Minimum<BundleState>> {
    let station =
        BundleState { camera: *scene.camera, light: Some(start), stage: None, poses: scene.poses.to_vec() };
    let mut free = vec![false; CAMERA_PARAMETERS];
    free.resize(station.globals(), true);
    let bundle = Bundle::new(Vec::new(), laser.to_vec(), free, false, priors, scene.poses.len());
    minimise(&bundle, station).filter(|minimum| minimum.cost.is_finite())
}

/// Positions of the laser points on their boards, camera frame.
pub fn lit_points(scene: &Scene, laser: &[LaserObservation]) -> Vec<LitPoint> {
    laser
        .iter()
        .filter_map(|point| {
            let hit_in_camera = board_hit(scene.camera, &scene.poses[point.block], point)?;
            Some(LitPoint { order: point.order, hit_in_camera })
        })
        .collect()
}

/// Intersection of the ray of a laser point with its board.
pub fn board_hit(camera: &Camera, pose: &BoardPose, point: &LaserObservation) -> Option<Vector3<f64>> {
    let ray = camera.ray_from_pixel(&point.pixel)?;
    let normal = pose.axes().column(2);
    let depth = normal.dot(&pose.translation_mm) / normal.dot(&ray);
    (depth.is_finite() && depth > 0.0).then(|| ray * depth)
}

/// The priors of a model in a scene.
pub fn light_priors(scene: &Scene, light: &LightSurfaces, points: &[LitPoint]) -> Priors {
    let grating = match light {
        LightSurfaces::Grating(grating) => Some(Priors::of_grating(lit_centre(points), &grating.source_mm)),
        LightSurfaces::Planes(_) | LightSurfaces::Pencil(_) => None,
    };
    Priors {
        camera: Vec::new(),
        wavelength_over_period: scene.nominal_wavelength_over_period.map(Priors::of_wavelength_over_period),
        grating,
    }
}

fn first_light(
    scene: &Scene,
    laser: &[LaserObservation],
    points: &[LitPoint],
    kind: LightModelKind,
) -> Result<LightSurfaces, CalibrationError> {
    let refused = |reason: &str| CalibrationError::LightModel { model: kind.name(), reason: reason.to_owned() };
    if kind == LightModelKind::Planes {
        let planes = planes_from_points(scene.orders, points)
            .ok_or_else(|| refused("an order has too few points on the boards for a plane"))?;
        return Ok(LightSurfaces::Planes(planes));
    }
    // On one board an order is a line, which is contained in many planes.
    let n_boards = |order: i8| {
        let of_order = laser.iter().filter(|p| p.order == order).map(|p| p.block);
        of_order.collect::<std::collections::BTreeSet<usize>>().len()
    };
    let seen: Vec<i8> =
        scene.orders.iter().copied().filter(|order| n_boards(*order) >= MIN_RANKED_BOARDS).collect();
    let planes =
        planes_from_points(&seen, points).ok_or_else(|| refused("an order has too few points on the boards"))?;
    let pencil = scene
        .nominal_wavelength_over_period
        .and_then(|sheet| pencil_from_planes(&planes, points, sheet))
        .ok_or_else(|| refused("it needs at least two orders"))?;
    if kind == LightModelKind::Pencil {
        return Ok(LightSurfaces::Pencil(pencil));
    }
    let LightSurfaces::Pencil(pencil) = approached(scene, laser, points, LightSurfaces::Pencil(pencil)) else {
        return Err(refused("its initial estimate is not a pencil"));
    };
    let grating = grating_from_pencil(&pencil, &lit_centre(points));
    Ok(approached(scene, laser, points, LightSurfaces::Grating(grating)))
}
