//! Initial estimates that are robust against points of other objects.

use nalgebra::{Matrix3, Vector3};
use rand::Rng;
use rand_pcg::Pcg64Mcg;

use crate::fitting::sample::{Samples, thinned};
use crate::interface::shape::Shape;
use crate::params::{
    CYLINDER_HYPOTHESES, NORMAL_NEIGHBOURS, NORMAL_POINTS, PLANE_HYPOTHESES, RANSAC_BAND_SIGMAS, RANSAC_POINTS,
    SPHERE_HYPOTHESES,
};

/// Smallest sine between two normals that determine a cylinder's axis: 10°.
const MIN_NORMAL_SINE: f64 = 0.17;

/// Range of radii (mm) of a hypothesis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RadiusRange {
    pub(crate) min_mm: f64,
    pub(crate) max_mm: f64,
}

/// The hypothesis with the most points in its band, points closer to its surface weighted more (MSAC).
struct Best {
    band_mm: f64,
    score: f64,
    shape: Option<Shape>,
}

impl Best {
    fn new(samples: &Samples) -> Self {
        Self { band_mm: RANSAC_BAND_SIGMAS * samples.sigma_mm, score: 0.0, shape: None }
    }

    fn consider(&mut self, shape: Shape, points: &[Vector3<f64>]) {
        let score = points
            .iter()
            .map(|p| {
                let share = shape.distance_mm(p) / self.band_mm;
                (1.0 - share * share).max(0.0)
            })
            .sum::<f64>();
        if score > self.score {
            (self.score, self.shape) = (score, Some(shape));
        }
    }
}

fn positions(samples: &Samples, candidates: &[u32], limit: usize) -> Vec<Vector3<f64>> {
    thinned(candidates, limit).iter().map(|&idx| samples.position(idx)).collect()
}

fn pick<'a, T>(rng: &mut Pcg64Mcg, from: &'a [T]) -> &'a T {
    &from[rng.random_range(0..from.len())]
}

/// The plane with the most points.
pub(crate) fn plane(samples: &Samples, candidates: &[u32], rng: &mut Pcg64Mcg) -> Option<Shape> {
    let points = positions(samples, candidates, RANSAC_POINTS);
    let mut best = Best::new(samples);
    if points.len() < 3 {
        return None;
    }
    for _ in 0..PLANE_HYPOTHESES {
        let [a, b, c] = [(); 3].map(|()| *pick(rng, &points));
        if let Some(normal) = (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE) {
            best.consider(Shape::Plane { point_mm: a, normal }, &points);
        }
    }
    best.shape
}

/// The plane of a given normal with the most points.
pub(crate) fn parallel_plane(
    samples: &Samples,
    candidates: &[u32],
    normal: &Vector3<f64>,
    rng: &mut Pcg64Mcg,
) -> Option<Shape> {
    let points = positions(samples, candidates, RANSAC_POINTS);
    let mut best = Best::new(samples);
    for _ in 0..PLANE_HYPOTHESES.min(points.len()) {
        best.consider(Shape::Plane { point_mm: *pick(rng, &points), normal: *normal }, &points);
    }
    best.shape
}

/// The sphere with the most points.
pub(crate) fn sphere(
    samples: &Samples,
    candidates: &[u32],
    radii: RadiusRange,
    rng: &mut Pcg64Mcg,
) -> Option<Shape> {
    let points = positions(samples, candidates, RANSAC_POINTS);
    let mut best = Best::new(samples);
    if points.len() < 4 {
        return None;
    }
    for _ in 0..SPHERE_HYPOTHESES {
        let corners = [(); 4].map(|()| *pick(rng, &points));
        if let Some(shape) = sphere_through(&corners).filter(|shape| in_range(shape, radii)) {
            best.consider(shape, &points);
        }
    }
    best.shape
}

fn in_range(shape: &Shape, radii: RadiusRange) -> bool {
    match shape {
        Shape::Plane { .. } => true,
        Shape::Sphere { radius_mm, .. } | Shape::Cylinder { radius_mm, .. } => {
            (radii.min_mm..=radii.max_mm).contains(radius_mm)
        }
    }
}

/// 2(Pᵢ − P₀)·C = |Pᵢ|² − |P₀|² for three i, taken about P₀.
fn sphere_through(corners: &[Vector3<f64>; 4]) -> Option<Shape> {
    let sides = [1, 2, 3].map(|idx| corners[idx] - corners[0]);
    let matrix = Matrix3::from_rows(&sides.map(|side| side.transpose() * 2.0));
    let offset = matrix.try_inverse()? * Vector3::from(sides.map(|side| side.norm_squared()));
    let radius_mm = offset.norm();
    radius_mm.is_finite().then_some(Shape::Sphere { centre_mm: corners[0] + offset, radius_mm })
}

/// The cylinder with the most points, from pairs of points with normals.
pub(crate) fn cylinder(
    samples: &Samples,
    candidates: &[u32],
    radii: RadiusRange,
    rng: &mut Pcg64Mcg,
) -> Option<Shape> {
    let points = positions(samples, candidates, NORMAL_POINTS);
    if points.len() <= NORMAL_NEIGHBOURS {
        return None;
    }
    let with_normals: Vec<(Vector3<f64>, Vector3<f64>)> =
        points.iter().filter_map(|p| Some((*p, local_normal(&points, p)?))).collect();
    if with_normals.len() < 2 {
        return None;
    }
    let mut best = Best::new(samples);
    for _ in 0..CYLINDER_HYPOTHESES {
        let (a, b) = (pick(rng, &with_normals), pick(rng, &with_normals));
        if let Some(shape) = cylinder_through(a, b).filter(|shape| in_range(shape, radii)) {
            best.consider(shape, &points);
        }
    }
    best.shape
}

/// Direction of least spread of the nearest points.
fn local_normal(points: &[Vector3<f64>], at: &Vector3<f64>) -> Option<Vector3<f64>> {
    let mut by_distance: Vec<(f64, usize)> =
        points.iter().enumerate().map(|(idx, p)| ((p - at).norm_squared(), idx)).collect();
    by_distance.select_nth_unstable_by(NORMAL_NEIGHBOURS, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let near: Vec<Vector3<f64>> = by_distance[..NORMAL_NEIGHBOURS].iter().map(|(_, idx)| points[*idx]).collect();
    let centroid = near.iter().sum::<Vector3<f64>>() / near.len() as f64;
    let spread: Matrix3<f64> = near.iter().map(|p| (p - centroid) * (p - centroid).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    eigen.eigenvectors.column(least).into_owned().try_normalize(f64::MIN_POSITIVE)
}

/// The axis is perpendicular to both normals and meets both normal lines.
fn cylinder_through(first: &(Vector3<f64>, Vector3<f64>), second: &(Vector3<f64>, Vector3<f64>)) -> Option<Shape> {
    let axis = first.1.cross(&second.1);
    if axis.norm() < MIN_NORMAL_SINE {
        return None;
    }
    let axis = axis.normalize();
    let flatten = |v: Vector3<f64>| v - axis * axis.dot(&v);
    let between = flatten(second.0 - first.0);
    // first + s·n₁ = second + t·n₂ in the plane across the axis.
    let sine = first.1.cross(&second.1).dot(&axis);
    let reach = between.cross(&second.1).dot(&axis) / sine;
    let point_mm = first.0 + first.1 * reach;
    let radius_mm = (flatten(first.0 - point_mm).norm() + flatten(second.0 - point_mm).norm()) / 2.0;
    Some(Shape::Cylinder { point_mm, axis, radius_mm })
}
