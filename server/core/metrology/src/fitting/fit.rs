//! Weighted geometric least squares by damped Gauss–Newton steps.

use least_squares::{Damping, Termination};
use nalgebra::{Cholesky, Const, SMatrix, SVector, Vector3};
use rayon::prelude::*;

use crate::interface::shape::{MAX_PARAMETERS, Shape};

pub(crate) type Matrix = SMatrix<f64, MAX_PARAMETERS, MAX_PARAMETERS>;
pub(crate) type Vector = SVector<f64, MAX_PARAMETERS>;
type Factor = Cholesky<f64, Const<MAX_PARAMETERS>>;

/// Most steps of a fit; a good start needs 3–6.
const MAX_STEPS: usize = 60;

/// Converged when the parameters are closer than this to the solution: squared, in standard deviations.
const GRADIENT_TOLERANCE: f64 = 1e-16;

/// Converged when no parameter moves by more than this (mm, rad), which is below anything measurable.
const STEP_TOLERANCE: f64 = 1e-10;

/// A cost below this is accepted when rounding keeps it from falling: a ten-thousandth of a standard deviation,
/// squared.
const COST_TOLERANCE: f64 = 1e-8;

/// Initial damping, in squares of each parameter's own unit, and its range.
const FIRST_DAMPING: f64 = 1e-6;
const MIN_DAMPING: f64 = 1e-12;
const MAX_DAMPING: f64 = 1e8;

/// Equations with a smaller least eigenvalue determine a parameter by rounding alone; an arc of 5° has 1e-6.
const LEAST_EIGENVALUE: f64 = 1e-12;

/// Points summed by one task.
const CHUNK_POINTS: usize = 8192;

/// A point with its weight 1/σ² (σ along the normal, mm).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weighted {
    pub(crate) position: Vector3<f64>,
    /// Unit vector from the camera, the direction of the point's error.
    pub(crate) ray: Vector3<f64>,
    pub(crate) weight: f64,
}

/// The points of a fit, which need not be in memory all at once.
pub(crate) trait Points: Sync {
    fn len(&self) -> usize;
    fn at(&self, idx: usize) -> Weighted;
}

impl Points for Vec<Weighted> {
    fn len(&self) -> usize {
        self.len()
    }

    fn at(&self, idx: usize) -> Weighted {
        self[idx]
    }
}

struct Normal {
    hessian: Matrix,
    gradient: Vector,
}

/// Solves Σ w·residual·slope = 0 (along the normals, for errors along the rays) from `start`; `None` if the points do
/// not determine the shape's parameters, or the solver did not converge.
///
/// The slopes are those at the foot of each point, so this is not the minimum of Σ w·residual², which is biased where
/// the surface is curved. Every step reduces the squared distance to the solution, gᵀH⁻¹g, in σ.
pub(crate) fn fit(start: &Shape, points: &impl Points) -> Option<Shape> {
    let (shape, termination) = solve(start, points, MAX_STEPS)?;
    (termination != Termination::NotConverged && are_determined(&normal_equations(&shape, points)?.hessian))
        .then_some(shape)
}

/// Whether the points determine every parameter: by the least eigenvalue of the equations, each parameter in its own
/// unit.
fn are_determined(hessian: &Matrix) -> bool {
    let unit = hessian.diagonal().map(|square| square.sqrt().recip());
    let scaled = Matrix::from_fn(|row, column| hessian[(row, column)] * unit[row] * unit[column]);
    unit.iter().all(|unit| unit.is_finite()) && scaled.symmetric_eigenvalues().min() > LEAST_EIGENVALUE
}

/// [`fit`] with the termination reason.
fn solve(start: &Shape, points: &impl Points, max_steps: usize) -> Option<(Shape, Termination)> {
    if points.len() < start.parameters() {
        return None;
    }
    let centroid =
        (0..points.len()).map(|idx| points.at(idx).position).sum::<Vector3<f64>>() / points.len() as f64;
    let mut shape = start.anchored(&centroid);
    let mut normal = normal_equations(&shape, points)?;
    let mut damping = Damping::new(FIRST_DAMPING, MIN_DAMPING, MAX_DAMPING);
    for _ in 0..max_steps {
        let distance = Cholesky::new(normal.hessian)?;
        let cost = squared(&distance, &normal.gradient);
        if cost <= GRADIENT_TOLERANCE {
            return Some((shape.anchored(&centroid), Termination::Gradient));
        }
        let step = damped_step(&normal, damping.value())?;
        let candidate = shape.stepped(&step.into());
        let next = normal_equations(&candidate, points);
        // Both in the metric at the start of the step: a metric that changes with the step could hide an increase.
        let falls = |next: &Normal| squared(&distance, &next.gradient) < cost;
        let is_free = damping.is_weak();
        match next.filter(falls) {
            Some(next) => {
                (shape, normal) = (candidate, next);
                damping.decrease();
                if is_free && step.amax() <= STEP_TOLERANCE {
                    return Some((shape.anchored(&centroid), Termination::Step));
                }
            }
            None if is_free && cost <= COST_TOLERANCE => {
                return Some((shape.anchored(&centroid), Termination::Cost));
            }
            None if !damping.increase() => break,
            None => {}
        }
    }
    Some((shape, Termination::NotConverged))
}

/// gᵀH⁻¹g.
fn squared(hessian: &Factor, gradient: &Vector) -> f64 {
    gradient.dot(&hessian.solve(gradient))
}

/// Sums over chunks of fixed size, added in order: identical bits for any number of threads.
fn normal_equations(shape: &Shape, points: &impl Points) -> Option<Normal> {
    let n_points = points.len();
    let chunk = |idx: usize| idx * CHUNK_POINTS..((idx + 1) * CHUNK_POINTS).min(n_points);
    let chunks = (0..n_points.div_ceil(CHUNK_POINTS)).into_par_iter().map(chunk);
    let sums: Vec<Sums> = chunks.map(|chunk| Sums::of(shape, chunk.map(|idx| points.at(idx)))).collect();
    let sums = sums.into_iter().reduce(Sums::plus)?;
    let mut hessian = Matrix::from_fn(|row, column| sums.hessian[row.min(column)][row.max(column)]);
    for unused in shape.parameters()..MAX_PARAMETERS {
        hessian[(unused, unused)] = 1.0;
    }
    let gradient = Vector::from(sums.gradient);
    gradient.iter().all(|g| g.is_finite()).then_some(Normal { hessian, gradient })
}

/// Upper triangle of Σ w a aᵀ, and Σ w r a.
struct Sums {
    hessian: [[f64; MAX_PARAMETERS]; MAX_PARAMETERS],
    gradient: [f64; MAX_PARAMETERS],
}

impl Sums {
    fn of(shape: &Shape, points: impl Iterator<Item = Weighted>) -> Self {
        let linear = shape.linearised();
        let n = shape.parameters();
        let mut sums = Self { hessian: [[0.0; MAX_PARAMETERS]; MAX_PARAMETERS], gradient: [0.0; MAX_PARAMETERS] };
        for point in points {
            let (residual, slopes) = linear.residual_and_gradient(&point.position, &point.ray);
            for (row, slope) in slopes.iter().enumerate().take(n) {
                let scaled = point.weight * slope;
                sums.gradient[row] += scaled * residual;
                for (slot, other) in sums.hessian[row][row..n].iter_mut().zip(&slopes[row..n]) {
                    *slot += scaled * other;
                }
            }
        }
        sums
    }

    fn plus(mut self, other: Self) -> Self {
        for (row, other_row) in self.hessian.iter_mut().flatten().zip(other.hessian.iter().flatten()) {
            *row += other_row;
        }
        for (value, other_value) in self.gradient.iter_mut().zip(&other.gradient) {
            *value += other_value;
        }
        self
    }
}

fn damped_step(normal: &Normal, damping: f64) -> Option<Vector> {
    let mut damped = normal.hessian;
    for idx in 0..MAX_PARAMETERS {
        damped[(idx, idx)] *= 1.0 + damping;
    }
    Some(-damped.cholesky()?.solve(&normal.gradient))
}

/// Covariance of the local parameters for the given variances of the points' errors along the normal: H⁻¹ (Σ w² v a aᵀ)
/// H⁻¹ with H = Σ w a aᵀ.
pub(crate) fn covariance(shape: &Shape, points: &impl Points, variances: &[f64]) -> Option<Matrix> {
    let linear = shape.linearised();
    let mut spread = Matrix::zeros();
    for (idx, variance) in variances.iter().enumerate() {
        let point = points.at(idx);
        let slopes = Vector::from(linear.residual_and_gradient(&point.position, &point.ray).1);
        spread += slopes * slopes.transpose() * (point.weight * point.weight * variance);
    }
    let inverse = normal_equations(shape, points)?.hessian.try_inverse()?;
    Some(inverse * spread * inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a cap of a ball of 20 mm, viewed from the origin, displaced along the rays by ±`push_mm` alternately.
    fn cap(push_mm: f64, weight: f64) -> Vec<Weighted> {
        let centre = Vector3::new(3.0, -2.0, 400.0);
        let place = |idx: i32| {
            let (across, down) = (f64::from(idx % 20) - 9.5, f64::from(idx / 20) - 9.5);
            let outward = Vector3::new(across, down, -20.0).normalize();
            let position = centre + outward * 20.0;
            let ray = position.normalize();
            Weighted { position: position + ray * push_mm * f64::from(idx % 3 - 1), ray, weight }
        };
        (0..400).map(place).collect()
    }

    fn ball(radius_mm: f64) -> Shape {
        Shape::Sphere { centre_mm: Vector3::new(3.0, -2.0, 400.0), radius_mm }
    }

    #[test]
    fn a_solved_fit_ends_by_its_gradient() {
        let (shape, end) = solve(&ball(21.0), &cap(0.03, 1e3), MAX_STEPS).unwrap();
        assert_eq!(end, Termination::Gradient);
        let again = solve(&shape, &cap(0.03, 1e3), MAX_STEPS).unwrap();
        assert_eq!(again, (shape, Termination::Gradient));
    }

    #[test]
    fn a_step_too_short_to_be_measured_ends_a_fit() {
        // Points known to a picometre: nothing is solved to a hundred-millionth of that, but the steps become
        // negligible.
        let (shape, end) = solve(&ball(20.0 + 1e-11), &cap(0.0, 1e18), MAX_STEPS).unwrap();
        assert_eq!(end, Termination::Step);
        let Shape::Sphere { radius_mm, .. } = shape else { panic!("no sphere") };
        assert!((radius_mm - 20.0).abs() < 1e-10);
    }

    #[test]
    fn a_cost_that_rounding_keeps_from_falling_ends_a_fit() {
        // Rounding of coordinates of 400 mm is worth 1e-5 σ here: less than COST_TOLERANCE, more than GRADIENT_TOLERANCE.
        let points = cap(0.0, 1e17);
        let mut shape = ball(20.0);
        let ended = (0..50).find_map(|_| {
            let (next, end) = solve(&shape, &points, MAX_STEPS).unwrap();
            shape = next;
            (end != Termination::Step).then_some(end)
        });
        assert_eq!(ended, Some(Termination::Cost));
    }

    #[test]
    fn a_solver_whose_steps_run_out_has_not_converged() {
        // From 8 to 20 mm takes more than one step, and a long step is not convergence.
        let (_, end) = solve(&ball(8.0), &cap(0.03, 1e3), 1).unwrap();
        assert_eq!(end, Termination::NotConverged);
    }

    #[test]
    fn points_that_determine_no_shape_are_refused_even_where_the_start_fits_them() {
        let one = cap(0.0, 1e3)[7];
        assert_eq!(fit(&ball(20.0), &vec![one; 40]), None);
        let plane = Shape::Plane { point_mm: one.position, normal: -Vector3::z() };
        assert_eq!(fit(&plane, &vec![one; 40]), None);
        // Collinear points: the plane may rotate about their line.
        let along = |idx: i32| Weighted { position: one.position + Vector3::x() * f64::from(idx), ..one };
        assert_eq!(fit(&plane, &(0..40).map(along).collect::<Vec<_>>()), None);
        assert!(fit(&ball(20.0), &cap(0.03, 1e3)).is_some());
    }

    #[test]
    fn no_step_increases_the_cost() {
        // From half the radius to the right one: every step reduces the distance to the solution.
        for start_mm in [8.0, 15.0, 19.0, 30.0] {
            let (shape, end) = solve(&ball(start_mm), &cap(0.03, 1e3), MAX_STEPS).unwrap();
            assert_ne!(end, Termination::NotConverged, "{start_mm}");
            let Shape::Sphere { radius_mm, .. } = shape else { panic!("no sphere") };
            assert!((radius_mm - 20.0).abs() < 0.05, "{start_mm}: {radius_mm}");
        }
    }
}
