//! Weighted geometric least squares by Levenberg–Marquardt.

use nalgebra::{SMatrix, SVector, Vector3};
use rayon::prelude::*;

use crate::shape::{MAX_PARAMETERS, Shape};

pub(crate) type Matrix = SMatrix<f64, MAX_PARAMETERS, MAX_PARAMETERS>;
pub(crate) type Vector = SVector<f64, MAX_PARAMETERS>;

/// Steps before a fit is called divergent; a good start needs 3–6.
const MAX_STEPS: usize = 60;

/// Converged when a step changes χ² by less than this: a ten-thousandth of a standard deviation.
const CHI2_TOLERANCE: f64 = 1e-8;

const FIRST_DAMPING: f64 = 1e-6;
const MAX_DAMPING: f64 = 1e8;

/// Points summed up by one task.
const CHUNK_POINTS: usize = 8192;

/// A point with its weight 1/σ² (σ along the normal, mm).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weighted {
    pub(crate) position: Vector3<f64>,
    /// Unit vector from the camera, along which the point errs.
    pub(crate) ray: Vector3<f64>,
    pub(crate) weight: f64,
}

struct Normal {
    hessian: Matrix,
    gradient: Vector,
    chi2: f64,
}

/// Minimises Σ w·residual² (along the normals, for errors along the rays) from `start`; `None` if the points do not hold the shape's parameters.
pub(crate) fn fit(start: &Shape, points: &[Weighted]) -> Option<Shape> {
    if points.len() < start.parameters() {
        return None;
    }
    let centroid = points.iter().map(|p| p.position).sum::<Vector3<f64>>() / points.len() as f64;
    let mut shape = start.anchored(&centroid);
    let mut normal = normal_equations(&shape, points)?;
    let mut damping = FIRST_DAMPING;
    for _ in 0..MAX_STEPS {
        let step = damped_step(&normal, damping)?;
        let candidate = shape.stepped(&step.into());
        let size = step.dot(&(normal.hessian * step));
        match normal_equations(&candidate, points) {
            Some(next) if next.chi2 <= normal.chi2 || size < CHI2_TOLERANCE => {
                (shape, normal) = (candidate, next);
                damping = (damping / 10.0).max(FIRST_DAMPING * 1e-6);
                if size < CHI2_TOLERANCE {
                    return Some(shape.anchored(&centroid));
                }
            }
            _ => damping *= 10.0,
        }
        if damping > MAX_DAMPING {
            return None;
        }
    }
    None
}

/// Sums over chunks of fixed size, added up in order: the same bits for any number of threads.
fn normal_equations(shape: &Shape, points: &[Weighted]) -> Option<Normal> {
    let sums: Vec<Sums> = points.par_chunks(CHUNK_POINTS).map(|chunk| Sums::of(shape, chunk)).collect();
    let sums = sums.into_iter().reduce(Sums::plus)?;
    let mut hessian = Matrix::from_fn(|row, column| sums.hessian[row.min(column)][row.max(column)]);
    for unused in shape.parameters()..MAX_PARAMETERS {
        hessian[(unused, unused)] = 1.0;
    }
    sums.chi2.is_finite().then_some(Normal { hessian, gradient: Vector::from(sums.gradient), chi2: sums.chi2 })
}

/// Upper triangle of Σ w a aᵀ, Σ w r a and Σ w r².
struct Sums {
    hessian: [[f64; MAX_PARAMETERS]; MAX_PARAMETERS],
    gradient: [f64; MAX_PARAMETERS],
    chi2: f64,
}

impl Sums {
    fn of(shape: &Shape, points: &[Weighted]) -> Self {
        let linear = shape.linearised();
        let n = shape.parameters();
        let mut sums =
            Self { hessian: [[0.0; MAX_PARAMETERS]; MAX_PARAMETERS], gradient: [0.0; MAX_PARAMETERS], chi2: 0.0 };
        for point in points {
            let (residual, slopes) = linear.residual_and_gradient(&point.position, &point.ray);
            sums.chi2 += point.weight * residual * residual;
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
        self.chi2 += other.chi2;
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

/// Covariance of the local parameters when the points' errors along the normal have the given variances:
/// H⁻¹ (Σ w² v a aᵀ) H⁻¹ with H = Σ w a aᵀ.
pub(crate) fn covariance(shape: &Shape, points: &[Weighted], variances: &[f64]) -> Option<Matrix> {
    let linear = shape.linearised();
    let mut spread = Matrix::zeros();
    for (point, variance) in points.iter().zip(variances) {
        let slopes = Vector::from(linear.residual_and_gradient(&point.position, &point.ray).1);
        spread += slopes * slopes.transpose() * (point.weight * point.weight * variance);
    }
    let inverse = normal_equations(shape, points)?.hessian.try_inverse()?;
    Some(inverse * spread * inverse)
}
