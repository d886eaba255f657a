//! The Cramér–Rao bound of the joint problem: the smallest depth error of any unbiased estimator from these pixels.

use calibration::bundle_state::BundleState;
use calibration::solver::Problem;
use nalgebra::Vector2;
use optics::{Calibration, LightSurfaces};

use super::fit::{KnownCamera, calibration, free_parameters, joint_bundle};
use super::regime::Regime;
use super::simulate::Simulation;

/// RMS over the working volume of the depth σ from the Fisher information at the truth, including the priors, mm.
pub fn depth_bound_mm(
    regime: &Regime,
    simulation: &Simulation,
    volume: &[(i8, Vector2<f64>, f64)],
    known_camera: KnownCamera,
) -> Option<f64> {
    let truth = BundleState {
        camera: simulation.camera,
        light: Some(LightSurfaces::Grating(simulation.grating)),
        stage: None,
        poses: simulation.poses.clone(),
    };
    let bundle = joint_bundle(regime, simulation, &truth, known_camera);
    let covariance = bundle.linearise(&truth).global_covariance(&free_parameters(&truth, known_camera))?;
    let exact = Calibration {
        covariance,
        ..calibration(regime, truth.camera, LightSurfaces::Grating(simulation.grating))
    };
    let squares: Vec<f64> = volume
        .iter()
        .filter_map(|(order, pixel, _)| {
            let point = exact.triangulate(*order, pixel, None)?;
            Some((exact.systematic_sigma_mm(*order, &point)? / point.ray.norm()).powi(2))
        })
        .collect();
    Some((squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt())
}
