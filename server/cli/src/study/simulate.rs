//! Simulated observations in a regime: corners and laser points with known noise.

use calibration::bundle_state::BoardPose;
use calibration::observation::{CornerObservation, CornerView, LaserObservation};
use nalgebra::{Vector2, Vector3};
use optics::{Camera, Grating};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

use super::regime::{BOARD_COLUMNS, BOARD_ROWS, DISTANCE_MM, HALF_DEPTH_MM, Regime};

/// Fan angle step for tracing a line before it is sampled, rad: 0.04 px of sag between two steps.
const TRACE_STEP_RAD: f64 = 2e-3;

/// Ground truth and simulated observations.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// True camera.
    pub camera: Camera,
    /// True grating.
    pub grating: Grating,
    /// True poses, one block each.
    pub poses: Vec<BoardPose>,
    /// Corners with noise.
    pub views: Vec<CornerView>,
    /// Laser points with noise.
    pub laser: Vec<LaserObservation>,
}

/// Simulates a regime with random poses and noise.
pub fn simulated(regime: &Regime, random: &mut Pcg64Mcg) -> Simulation {
    let (camera, grating) = (regime.camera(), regime.grating());
    let poses = regime.poses(random);
    let views = poses
        .iter()
        .enumerate()
        .map(|(block, pose)| CornerView { block, travel_mm: 0.0, corners: corners(regime, &camera, pose, random) })
        .collect();
    let mut laser = Vec::new();
    for (block, pose) in poses.iter().enumerate() {
        for order in regime.orders() {
            laser.extend(line(regime, &camera, &grating, pose, block, order, random));
        }
    }
    Simulation { camera, grating, poses, views, laser }
}

/// Points on every light sheet throughout the working volume, as noise-free pixels: (order, pixel, depth in mm).
pub fn working_volume(regime: &Regime) -> Vec<(i8, Vector2<f64>, f64)> {
    let (camera, grating) = (regime.camera(), regime.grating());
    let half = regime.field_half_width_mm;
    let mut points = Vec::new();
    for order in regime.orders() {
        for depth_step in -2..=2 {
            let plate_mm = DISTANCE_MM + HALF_DEPTH_MM * f64::from(depth_step) / 2.0;
            for place in -4..=4 {
                let x_mm = half * f64::from(place) / 4.0;
                let phi = x_mm.atan2(DISTANCE_MM);
                let Some(ray) = grating.ray(phi, order) else { continue };
                let range_mm = (plate_mm - ray.origin_mm.z) / ray.direction.z;
                let point = ray.origin_mm + ray.direction * range_mm;
                if let Some(pixel) = camera.project(&point) {
                    points.push((order, pixel, point.z));
                }
            }
        }
    }
    points
}

fn noise(random: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(random)
}

fn corners(regime: &Regime, camera: &Camera, pose: &BoardPose, random: &mut Pcg64Mcg) -> Vec<CornerObservation> {
    let sigma_px = regime.corner_sigma_px;
    let mut observations = Vec::with_capacity(BOARD_COLUMNS * BOARD_ROWS);
    for row in 0..BOARD_ROWS {
        for column in 0..BOARD_COLUMNS {
            let board_mm = Vector3::new(column as f64, row as f64, 0.0) * regime.square_mm();
            let Some(pixel) = camera.project(&(pose.rotation * board_mm + pose.translation_mm)) else { continue };
            let pixel = pixel + Vector2::new(noise(random), noise(random)) * sigma_px;
            if !in_image(camera, &pixel) {
                continue;
            }
            observations.push(CornerObservation { board_mm, pixel, sigma_px });
        }
    }
    observations
}

/// One line on one board: a point per column within the board and the image.
fn line(
    regime: &Regime,
    camera: &Camera,
    grating: &Grating,
    pose: &BoardPose,
    block: usize,
    order: i8,
    random: &mut Pcg64Mcg,
) -> Vec<LaserObservation> {
    let half_angle = 1.3 * regime.field_half_width_mm.atan2(DISTANCE_MM);
    let n_steps = (2.0 * half_angle / TRACE_STEP_RAD).ceil() as usize;
    let trace: Vec<(Vector2<f64>, bool)> = (0..=n_steps)
        .filter_map(|step| {
            let phi = -half_angle + 2.0 * half_angle * step as f64 / n_steps as f64;
            lit_pixel(regime, camera, grating, pose, phi, order)
        })
        .collect();
    let mut points = Vec::new();
    let mut next_u = f64::NEG_INFINITY;
    for pair in trace.windows(2) {
        let ((from, from_on), (to, to_on)) = (pair[0], pair[1]);
        if !(from_on && to_on) {
            continue;
        }
        next_u = next_u.max(from.x);
        let along = (to - from).normalize();
        let across = Vector2::new(-along.y, along.x);
        while next_u < to.x {
            let pixel = from + (to - from) * ((next_u - from.x) / (to.x - from.x));
            let seen = pixel + across * (noise(random) * regime.line_sigma_px);
            points.push(LaserObservation {
                block,
                order,
                pixel: seen,
                sigma_px: regime.line_sigma_px,
                effective_weight: 1.0,
            });
            next_u += regime.line_spacing_px;
        }
    }
    points
}

/// The pixel at which the fan ray φ of an order hits the plane of the board, and whether it is on the board, within the
/// field and in the image.
fn lit_pixel(
    regime: &Regime,
    camera: &Camera,
    grating: &Grating,
    pose: &BoardPose,
    phi: f64,
    order: i8,
) -> Option<(Vector2<f64>, bool)> {
    let ray = grating.ray(phi, order)?;
    let normal = pose.axes().column(2);
    let range_mm = normal.dot(&(pose.translation_mm - ray.origin_mm)) / normal.dot(&ray.direction);
    let hit = ray.origin_mm + ray.direction * range_mm;
    let pixel = camera.project(&hit)?;
    let squares = (pose.rotation.inverse() * (hit - pose.translation_mm)) / regime.square_mm();
    let on_board =
        squares.x > -1.0 && squares.x < BOARD_COLUMNS as f64 && squares.y > -1.0 && squares.y < BOARD_ROWS as f64;
    let in_field = hit.x.abs() <= regime.field_half_width_mm * hit.z / DISTANCE_MM;
    Some((pixel, on_board && in_field && in_image(camera, &pixel)))
}

fn in_image(camera: &Camera, pixel: &Vector2<f64>) -> bool {
    let (right, bottom) = (camera.width_px as f64 - 1.0, camera.height_px as f64 - 1.0);
    pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x <= right && pixel.y <= bottom
}
