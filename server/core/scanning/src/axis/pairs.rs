//! Pairs of surfels of the same point of the surface, and their residuals as a function of the axis
//! (`docs/maths/turntable.md`, eq. 13).

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector3, Vector4};
use optics::{Motion, PointMm, RotaryAxis};
use rayon::prelude::*;
use statistics::median;
use std::collections::HashMap;

use crate::axis::surfels::Surfel;

/// Smallest cosine between the normals of two surfels of the same surface.
const MIN_NORMAL_COSINE: f64 = 0.9;
/// Steps of the derivative: tilts in rad, shifts in mm.
const STEPS: [f64; 4] = [1e-5, 1e-5, 1e-3, 1e-3];

/// Two surfels of the same point of the surface.
pub struct Pair {
    /// Their distance along the mean of their normals.
    pub apart_mm: f64,
    /// One σ of that from noise.
    pub sigma_mm: f64,
    /// Its derivatives with respect to the four parameters of [`RotaryAxis::moved`].
    pub jacobian: Vector4<f64>,
    /// Expected contribution of the normals' noise to the outer product of `jacobian`.
    pub normal_noise: Matrix4<f64>,
}

/// A surfel in the part frame, for a given `axis`.
struct Placed<'a> {
    surfel: &'a Surfel,
    at_mm: Vector3<f64>,
    normal: Vector3<f64>,
    normal_covariance: Matrix3<f64>,
    /// Derivatives of its position with respect to the axis.
    by_axis: Matrix3x4<f64>,
}

/// Every surfel with the nearest one of another line, if they are close. A line is not paired with itself: after a
/// full turn it observes the same surface at the same position whatever the axis.
pub fn pairs(surfels: &[Surfel], axis: &RotaryAxis) -> Vec<Pair> {
    let moved: Vec<[RotaryAxis; 2]> = (0..4)
        .map(|idx| {
            [1.0, -1.0].map(|sign| {
                let mut step = [0.0; 4];
                step[idx] = sign * STEPS[idx];
                axis.moved(&step)
            })
        })
        .collect();
    let placed: Vec<Placed> = surfels.par_iter().map(|surfel| placed(surfel, axis, &moved)).collect();
    let mut radii_mm: Vec<f64> = surfels.iter().map(|surfel| surfel.radius_mm).collect();
    let Some(cell_mm) = median(&mut radii_mm).map(|radius_mm| 2.0 * radius_mm) else { return Vec::new() };
    let cell = |at: &Vector3<f64>| [at.x, at.y, at.z].map(|x| (x / cell_mm).floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    for (idx, place) in placed.iter().enumerate() {
        cells.entry(cell(&place.at_mm)).or_default().push(idx);
    }
    let nearest = |idx: usize| {
        let one = &placed[idx];
        let [x, y, z] = cell(&one.at_mm);
        let around = (0..27).map(|k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
        let others = around.filter_map(|at| cells.get(&at)).flatten().copied();
        let apart = |other: &usize| (placed[*other].at_mm - one.at_mm).norm();
        let suits = |other: &usize| is_same_surface(one, &placed[*other]) && apart(other) < cell_mm;
        others.filter(suits).min_by(|a, b| apart(a).total_cmp(&apart(b)))
    };
    let nearest: Vec<Option<usize>> = (0..placed.len()).into_par_iter().map(nearest).collect();
    let is_first = |idx: usize, other: usize| idx < other || nearest[other] != Some(idx);
    let both =
        |(idx, other): (usize, &Option<usize>)| other.filter(|&other| is_first(idx, other)).map(|o| (idx, o));
    nearest.iter().enumerate().filter_map(both).map(|(idx, other)| pair(&placed[idx], &placed[other])).collect()
}

fn placed<'a>(surfel: &'a Surfel, axis: &RotaryAxis, moved: &[[RotaryAxis; 2]]) -> Placed<'a> {
    let motion: Motion = axis.motion(surfel.angle_rad);
    let hit = PointMm::new(surfel.at_mm);
    let at = |axis: &RotaryAxis| axis.part_from_camera(&hit, surfel.angle_rad).xyz;
    let columns: Vec<Vector3<f64>> =
        moved.iter().zip(STEPS).map(|([more, less], step)| (at(more) - at(less)) / (2.0 * step)).collect();
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| motion.part_direction(&axis));
    let rotation = Matrix3::from_columns(&axes);
    Placed {
        surfel,
        at_mm: at(axis),
        normal: motion.part_direction(&surfel.normal),
        normal_covariance: rotation * surfel.normal_covariance * rotation.transpose(),
        by_axis: Matrix3x4::from_columns(&columns),
    }
}

fn is_same_surface(one: &Placed, other: &Placed) -> bool {
    one.surfel.line != other.surfel.line && one.normal.dot(&other.normal) > MIN_NORMAL_COSINE
}

/// The mean normal is perpendicular to the chord between two points of a surface of constant curvature, so that
/// curvature does not count as a distance.
fn pair(one: &Placed, other: &Placed) -> Pair {
    let normal = (one.normal + other.normal).normalize();
    let apart = one.at_mm - other.at_mm;
    let tilt_covariance = (one.normal_covariance + other.normal_covariance) / 4.0;
    let by_axis = one.by_axis - other.by_axis;
    let noise =
        one.surfel.sigma_mm.powi(2) + other.surfel.sigma_mm.powi(2) + apart.dot(&(tilt_covariance * apart));
    Pair {
        apart_mm: normal.dot(&apart),
        sigma_mm: noise.sqrt(),
        jacobian: by_axis.transpose() * normal,
        normal_noise: by_axis.transpose() * tilt_covariance * by_axis,
    }
}
