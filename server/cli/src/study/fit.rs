//! The fits of a study, with the solver of the calibration, and their depth errors.

use calibration::bundle::Bundle;
use calibration::bundle_state::BundleState;
use calibration::light_fit::{Scene, fit_light, light_priors, lit_points};
use calibration::prior::Priors;
use calibration::solver::minimise;
use nalgebra::{DMatrix, Vector2};
use optics::{CAMERA_PARAMETERS, Calibration, Camera, LightModelKind, LightSurfaces};

use super::regime::Regime;
use super::simulate::Simulation;

/// Whether the camera is known before the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KnownCamera {
    /// Intrinsics are given, exactly.
    Yes,
    /// Intrinsics are estimated together with everything else, except k3 = 0.
    No,
}

/// Fits one model to a simulation as `sheaf calibrate` does: boards from corners, plane models with fixed boards, the exact
/// model jointly with the boards (and with the camera if it is not known).
pub fn fitted(
    regime: &Regime,
    simulation: &Simulation,
    kind: LightModelKind,
    known_camera: KnownCamera,
) -> Option<Calibration> {
    let orders = regime.orders();
    let boards = boards_from_corners(simulation, known_camera)?;
    let scene = Scene {
        camera: &boards.camera,
        poses: &boards.poses,
        orders: &orders,
        nominal_wavelength_over_period: Some(regime.wavelength_over_period()),
    };
    let light = fit_light(&scene, &simulation.laser, kind, None).ok()?.light;
    if kind != LightModelKind::Grating {
        return Some(calibration(regime, boards.camera, light));
    }
    let station = BundleState { light: Some(light), ..boards.clone() };
    let bundle = joint_bundle(regime, simulation, &station, known_camera);
    let refined = minimise(&bundle, station)?.state;
    Some(calibration(regime, refined.camera, refined.light?))
}

/// The bundle adjustment of the joint problem, linearised around `station`.
pub fn joint_bundle(
    regime: &Regime,
    simulation: &Simulation,
    station: &BundleState,
    known_camera: KnownCamera,
) -> Bundle {
    let orders = regime.orders();
    let scene = Scene {
        camera: &station.camera,
        poses: &station.poses,
        orders: &orders,
        nominal_wavelength_over_period: Some(regime.wavelength_over_period()),
    };
    let light_only = station
        .light
        .as_ref()
        .map_or(Priors::default(), |light| light_priors(&scene, light, &lit_points(&scene, &simulation.laser)));
    let priors = Priors { camera: camera_priors(&station.camera, known_camera), ..light_only };
    let free = free_parameters(station, known_camera);
    Bundle::new(simulation.views.clone(), simulation.laser.clone(), free, true, priors, station.poses.len())
}

/// RMS depth error of a calibration over noise-free pixels, mm.
pub fn depth_rmse_mm(calibration: &Calibration, volume: &[(i8, Vector2<f64>, f64)]) -> f64 {
    let squares: Vec<f64> = volume
        .iter()
        .filter_map(|(order, pixel, depth_mm)| {
            Some((calibration.triangulate(*order, pixel, None)?.hit.depth_mm - depth_mm).powi(2))
        })
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// A calibration from a fit, with zero covariance.
pub fn calibration(regime: &Regime, camera: Camera, light: LightSurfaces) -> Calibration {
    let n = CAMERA_PARAMETERS + light.parameters();
    Calibration {
        id: String::new(),
        camera,
        orders: regime.orders(),
        light,
        stage: None,
        depth_range_mm: regime.depth_range_mm(),
        covariance: DMatrix::zeros(n, n),
    }
}

/// Whether each global parameter is estimated: k3 never, the rest of the camera if it is not known, all of the light.
pub fn free_parameters(station: &BundleState, known_camera: KnownCamera) -> Vec<bool> {
    let mut free = vec![known_camera == KnownCamera::No; CAMERA_PARAMETERS];
    free[CAMERA_PARAMETERS - 1] = false;
    free.resize(station.globals(), true);
    free
}

fn camera_priors(camera: &Camera, known_camera: KnownCamera) -> Vec<calibration::prior::GaussianPrior> {
    match known_camera {
        KnownCamera::Yes => Vec::new(),
        KnownCamera::No => Priors::of_camera(camera.width_px, camera.height_px, camera.fx_px),
    }
}

/// Poses (and camera) from the corners alone. Starts at the truth, since the minimum does not depend on the start.
fn boards_from_corners(simulation: &Simulation, known_camera: KnownCamera) -> Option<BundleState> {
    let truth =
        BundleState { camera: simulation.camera, light: None, stage: None, poses: simulation.poses.clone() };
    let priors = Priors { camera: camera_priors(&truth.camera, known_camera), ..Priors::default() };
    let free = free_parameters(&truth, known_camera);
    let bundle = Bundle::new(simulation.views.clone(), Vec::new(), free, true, priors, truth.poses.len());
    Some(minimise(&bundle, truth)?.state)
}
