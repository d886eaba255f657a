//! The final step of a calibration alone: joint refinement of camera, exact light and boards from a slightly wrong
//! initial state.

use calibration::bundle::Bundle;
use calibration::bundle_state::BundleState;
use calibration::light_fit::{Scene, light_priors, lit_points};
use calibration::observation::{CornerObservation, CornerView, LaserObservation};
use calibration::prior::Priors;
use nalgebra::{Vector2, Vector3};
use optics::LightSurfaces;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use vision::CentrelinePoint;

use super::Rig;

/// Images of the board with laser lines.
pub const POSES: usize = 15;
/// Noise of corners and of line points.
const CORNER_SIGMA_PX: f64 = 0.02;
/// See [`CORNER_SIGMA_PX`].
const LINE_SIGMA_PX: f64 = 0.05;
/// Relative error of the initial parameters.
const START_ERROR: f64 = 2e-4;

/// A bundle of corners and of `n_columns` points on each of five lines, and a slightly wrong initial state.
pub fn refinement(n_columns: usize) -> (Bundle, BundleState) {
    let rig = Rig { corner_sigma_px: CORNER_SIGMA_PX, line_sigma_px: 0.0, ..Rig::new(3) };
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let poses: Vec<_> = (0..POSES).map(|_| rig.pose(&mut random)).collect();
    let (mut views, mut laser) = (Vec::new(), Vec::new());
    for (block, pose) in poses.iter().enumerate() {
        let seen = rig.corners(pose, &mut random).corners;
        let corners = seen.iter().map(|c| CornerObservation {
            board_mm: Vector3::new(c.column as f64, c.row as f64, 0.0) * super::SQUARE_MM,
            pixel: Vector2::new(c.u_px, c.v_px),
            sigma_px: CORNER_SIGMA_PX,
        });
        views.push(CornerView { block, travel_mm: 0.0, corners: corners.collect() });
        for (line, segment) in rig.centrelines(pose, &mut random).segments.iter().enumerate() {
            for column in 0..n_columns {
                let noise: f64 = StandardNormal.sample(&mut random);
                let pixel = along(&segment.points, column as f64 / n_columns as f64);
                let pixel = pixel + Vector2::new(0.0, LINE_SIGMA_PX * noise);
                let order = rig.orders[line];
                laser.push(LaserObservation {
                    block,
                    order,
                    pixel,
                    sigma_px: LINE_SIGMA_PX,
                    effective_weight: 1.0,
                });
            }
        }
    }
    let light = LightSurfaces::Grating(rig.grating);
    let scene = Scene {
        camera: &rig.camera,
        poses: &poses,
        orders: &rig.orders,
        nominal_wavelength_over_period: Some(0.033),
    };
    let mut priors = light_priors(&scene, &light, &lit_points(&scene, &laser));
    priors.camera = Priors::of_camera(1280, 1024, 2500.0);
    let mut camera = rig.camera;
    camera.fx_px *= 1.0 + START_ERROR;
    camera.fy_px *= 1.0 + START_ERROR;
    let station = BundleState { camera, light: Some(light), stage: None, poses };
    let free = vec![true; station.globals()];
    (Bundle::new(views, laser, free, true, priors, POSES), station)
}

/// The point at a fraction of the way along a line.
fn along(points: &[CentrelinePoint], share: f64) -> Vector2<f64> {
    let place = share * (points.len() - 1) as f64;
    let (a, b) = (&points[place as usize], &points[place as usize + 1]);
    Vector2::new(a.u_px, a.v_px).lerp(&Vector2::new(b.u_px, b.v_px), place.fract())
}
