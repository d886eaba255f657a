//! Best-fit alignment of a scan with its nominal surface, and the degrees of freedom that the points do not constrain.
//!
//! Point-to-plane: residuals along the normal, each with the σ of its point along it (eq. 14–16 of
//! `docs/maths/metrology.md`), damped by Cauchy's weight so that a dent does not tilt the part.

use nalgebra::{Matrix6, Rotation3, SymmetricEigen, Vector3, Vector6};
use optics::{PartFrame, Rigid};
use rayon::prelude::*;
use statistics::{SIGMA_PER_MAD, median};

use crate::cad::nominal::Nominal;
use crate::evaluation::alignment::DatumFrame;
use crate::interface::request::MeasureError;
use crate::params::{BEST_FIT_LOCK_RATIO, BEST_FIT_MIN_POINTS, CAUCHY_SIGMAS, MIN_COSINE};

/// Most iterations; each searches for the nearest surface points again.
const MAX_STEPS: usize = 80;

/// A step that moves no point by more than this ends the fit, mm.
const STEP_TOLERANCE_MM: f64 = 1e-5;

/// Factor by which the reach shrinks per iteration, from the capture range to the final reach.
const REACH_SHRINK: f64 = 0.75;

/// A point of the fit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FitPoint {
    pub(crate) at: Vector3<f64>,
    pub(crate) ray: Vector3<f64>,
    pub(crate) sigma_mm: f64,
}

/// A residual with its derivatives by translation (mm) and by rotation about the centroid (mm at the distance `lever_mm`).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    pub(crate) slopes: Vector6<f64>,
    pub(crate) normal: Vector3<f64>,
    pub(crate) residual_mm: f64,
    pub(crate) sigma_mm: f64,
    pub(crate) weight: f64,
}

/// A fitted pose.
pub(crate) struct BestFit {
    pub(crate) pose: Rigid<DatumFrame, PartFrame>,
    /// H⁻¹ without the locked degrees of freedom.
    pub(crate) inverse: Matrix6<f64>,
    /// Ratio of the residuals to the predicted noise.
    pub(crate) ratio: f64,
    pub(crate) rms_mm: f64,
    /// Description of each degree of freedom that the points do not constrain.
    pub(crate) locked: Vec<String>,
}

/// Derivatives of the distance along `normal` at a point, by a motion about `middle`.
pub(crate) fn slopes(
    at: &Vector3<f64>,
    normal: &Vector3<f64>,
    middle: &Vector3<f64>,
    lever_mm: f64,
) -> Vector6<f64> {
    let turn = (at - middle).cross(normal) / lever_mm;
    Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z)
}

/// The rows of all points; `None` for points without a surface point within reach.
pub(crate) fn rows(
    nominal: &Nominal,
    points: &[FitPoint],
    pose: &Rigid<DatumFrame, PartFrame>,
    (middle, lever_mm): (&Vector3<f64>, f64),
    reach_mm: f64,
) -> Vec<Option<Row>> {
    let of = |point: &FitPoint| {
        let at = pose.rotation * point.at + pose.translation_mm;
        let ray = pose.rotation * point.ray;
        let nearest = nominal.nearest(&at, &ray, reach_mm * reach_mm, None)?;
        nominal.normal(&nearest)?;
        let normal = nominal.facets[nearest.facet as usize].normal;
        Some(Row {
            slopes: slopes(&at, &normal, middle, lever_mm),
            normal,
            residual_mm: normal.dot(&(at - nearest.at)),
            sigma_mm: point.sigma_mm * ray.dot(&normal).abs().max(MIN_COSINE),
            weight: 0.0,
        })
    };
    let mut rows: Vec<Option<Row>> = points.par_iter().map(of).collect();
    let scale = scale(&rows);
    for row in rows.iter_mut().flatten() {
        let share = row.residual_mm / (CAUCHY_SIGMAS * scale * row.sigma_mm);
        row.weight = 1.0 / (row.sigma_mm * row.sigma_mm * (1.0 + share * share));
    }
    rows
}

/// Robust ratio of residuals to predicted noise, at least 1.
fn scale(rows: &[Option<Row>]) -> f64 {
    let mut normalised: Vec<f64> =
        rows.iter().flatten().map(|row| (row.residual_mm / row.sigma_mm).abs()).collect();
    (SIGMA_PER_MAD * median(&mut normalised).unwrap_or(1.0)).max(1.0)
}

/// Aligns the points with the surface from a nearby pose. A degree of freedom is locked if the points constrain it far worse
/// than the others, or if its standard uncertainty exceeds a tenth of `tolerance_mm` at the fitted pose: before, the
/// residuals are those of a part that is not aligned yet, and say nothing about it.
///
/// # Errors
/// [`MeasureError::NoOverlap`], [`MeasureError::NotConverged`].
pub(crate) fn best_fit(
    nominal: &Nominal,
    points: &[FitPoint],
    start: &Rigid<DatumFrame, PartFrame>,
    reaches_mm: (f64, f64),
    tolerance_mm: Option<f64>,
) -> Result<BestFit, MeasureError> {
    let (fit, rows) = converged(nominal, points, start, reaches_mm, None)?;
    let kept = kept(&normal_equations(&rows).0, tolerance_mm.map(|tolerance_mm| tolerance_mm / 10.0 / fit.ratio));
    if kept.locked.len() == fit.locked.len() {
        return Ok(fit);
    }
    Ok(converged(nominal, points, start, reaches_mm, Some(&kept))?.0)
}

/// The fit on fixed degrees of freedom, or on those that the points constrain; and its last equations.
fn converged(
    nominal: &Nominal,
    points: &[FitPoint],
    start: &Rigid<DatumFrame, PartFrame>,
    (capture_mm, reach_mm): (f64, f64),
    fixed: Option<&Freedoms>,
) -> Result<(BestFit, Vec<Option<Row>>), MeasureError> {
    let mut pose = *start;
    let mut reach = capture_mm.max(reach_mm);
    for _ in 0..MAX_STEPS {
        let (middle, lever_mm) = middle(points, &pose);
        let rows = rows(nominal, points, &pose, (&middle, lever_mm), reach);
        let n_points = rows.iter().flatten().count();
        if n_points < BEST_FIT_MIN_POINTS {
            return Err(MeasureError::NoOverlap { n_points, reach_mm: reach });
        }
        let (hessian, gradient) = normal_equations(&rows);
        let of_points = fixed.is_none().then(|| kept(&hessian, None));
        let Freedoms { basis, locked } = fixed.or(of_points.as_ref()).expect("one of the two is given");
        let inverse = restricted_inverse(&hessian, basis);
        let step = -(inverse * gradient);
        pose = moved(&pose, &step, &middle, lever_mm);
        let is_whole = reach <= reach_mm;
        reach = (reach * REACH_SHRINK).max(reach_mm);
        if is_whole && step.norm() <= STEP_TOLERANCE_MM {
            let square: f64 = rows.iter().flatten().map(|row| row.residual_mm * row.residual_mm).sum();
            let rms_mm = (square / n_points as f64).sqrt();
            let fit = BestFit { pose, inverse, ratio: scale(&rows), rms_mm, locked: locked.clone() };
            return Ok((fit, rows));
        }
    }
    Err(MeasureError::NotConverged)
}

/// Centroid of the points in the datum frame, and their RMS distance from it.
pub(crate) fn middle(points: &[FitPoint], pose: &Rigid<DatumFrame, PartFrame>) -> (Vector3<f64>, f64) {
    let n = points.len().max(1) as f64;
    let in_part = points.iter().map(|point| point.at).sum::<Vector3<f64>>() / n;
    let square = points.iter().map(|point| (point.at - in_part).norm_squared()).sum::<f64>() / n;
    (pose.rotation * in_part + pose.translation_mm, square.sqrt().max(f64::MIN_POSITIVE))
}

/// A pose moved by a translation and a rotation about a centre.
pub(crate) fn moved(
    pose: &Rigid<DatumFrame, PartFrame>,
    step: &Vector6<f64>,
    middle: &Vector3<f64>,
    lever_mm: f64,
) -> Rigid<DatumFrame, PartFrame> {
    let turn = Rotation3::new(Vector3::new(step[3], step[4], step[5]) / lever_mm);
    let shift = Vector3::new(step[0], step[1], step[2]);
    Rigid::new(turn * pose.rotation, turn * (pose.translation_mm - middle) + middle + shift)
}

pub(crate) fn normal_equations(rows: &[Option<Row>]) -> (Matrix6<f64>, Vector6<f64>) {
    let start = (Matrix6::zeros(), Vector6::zeros());
    rows.iter().flatten().fold(start, |(hessian, gradient), row| {
        (
            hessian + row.slopes * row.slopes.transpose() * row.weight,
            gradient + row.slopes * (row.weight * row.residual_mm),
        )
    })
}

/// Degrees of freedom of a fit.
struct Freedoms {
    /// Those that are fitted.
    basis: Vec<Vector6<f64>>,
    /// Description of each of the others.
    locked: Vec<String>,
}

/// The degrees of freedom that the points constrain well enough; `most_sigma_mm`: the largest permitted σ of one.
fn kept(hessian: &Matrix6<f64>, most_sigma_mm: Option<f64>) -> Freedoms {
    let SymmetricEigen { eigenvalues, eigenvectors } = hessian.symmetric_eigen();
    let least = BEST_FIT_LOCK_RATIO * eigenvalues.max();
    let mut freedoms = Freedoms { basis: Vec::new(), locked: Vec::new() };
    for k in 0..6 {
        let (value, vector) = (eigenvalues[k], eigenvectors.column(k).into_owned());
        let sigma_mm = value.max(f64::MIN_POSITIVE).sqrt().recip();
        if value > least && most_sigma_mm.is_none_or(|most_mm| sigma_mm <= most_mm) {
            freedoms.basis.push(vector);
        } else {
            freedoms.locked.push(freedom(&vector));
        }
    }
    freedoms
}

/// B(BᵀHB)⁻¹Bᵀ: the inverse of H on the subspace spanned by the columns of B.
pub(crate) fn restricted_inverse(hessian: &Matrix6<f64>, basis: &[Vector6<f64>]) -> Matrix6<f64> {
    let n = basis.len();
    let small = nalgebra::DMatrix::from_fn(n, n, |i, j| (basis[i].transpose() * hessian * basis[j])[(0, 0)]);
    let Some(inverse) = small.try_inverse() else { return Matrix6::zeros() };
    let mut full = Matrix6::zeros();
    for i in 0..n {
        for j in 0..n {
            full += basis[i] * basis[j].transpose() * inverse[(i, j)];
        }
    }
    full
}

/// Description of a motion.
fn freedom(motion: &Vector6<f64>) -> String {
    let (shift, turn) = (motion.fixed_rows::<3>(0).into_owned(), motion.fixed_rows::<3>(3).into_owned());
    let words = |what: &str, v: Vector3<f64>| {
        let v = v.normalize();
        format!("{what} ({:.2}, {:.2}, {:.2})", v.x, v.y, v.z)
    };
    if shift.norm() >= turn.norm() {
        words("the translation along", shift)
    } else {
        words("the rotation about", turn)
    }
}
