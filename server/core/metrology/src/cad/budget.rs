//! The uncertainty of deviations: the noise of each point, errors common to all points, and their effect on the pose.

use std::collections::BTreeMap;

use nalgebra::{Matrix6, Vector3, Vector6};
use optics::{Calibration, PartFrame, Rigid};

use crate::cad::best_fit::{self, BestFit, FitPoint, Row, restricted_inverse, slopes};
use crate::cad::cell_means::ComparedPoint;
use crate::cad::nominal::Nominal;
use crate::evaluation::alignment::DatumFrame;
use crate::evaluation::datum_pose::DatumPose;
use crate::fitting::sample::{Samples, thinned};
use crate::interface::request::MeasureError;
use crate::interface::shape::Shape;
use crate::measuring::systematic::{Retriangulation, Variant};
use crate::params::{COMPARED_SYSTEMATIC_POINTS, FOOTPRINT_FACTOR, MIN_NOISE_RATIO};

pub(crate) fn fit_point(samples: &Samples, idx: u32) -> FitPoint {
    let sample = samples.at(idx);
    FitPoint { at: sample.in_part.xyz, ray: sample.ray, sigma_mm: sample.sigma_mm }
}

/// The pose of a comparison, and how it depends on the calibration and the noise.
pub(crate) struct ComparisonPose<'a> {
    pub(crate) fit: Option<&'a BestFit>,
    pub(crate) datums: Option<&'a DatumPose>,
    pub(crate) pose: Rigid<DatumFrame, PartFrame>,
    pub(crate) middle: Vector3<f64>,
    pub(crate) lever_mm: f64,
}

impl ComparisonPose<'_> {
    /// Covariance of the pose from the noise of all points (eq. 15).
    pub(crate) fn covariance(&self, redundancy: f64, n_few: usize, n_all: usize) -> Matrix6<f64> {
        match (self.fit, self.datums) {
            (Some(fit), _) => fit.inverse * (redundancy * fit.ratio * fit.ratio * n_few as f64 / n_all as f64),
            (None, Some(datums)) => datums.covariance(&self.middle, self.lever_mm),
            (None, None) => Matrix6::zeros(),
        }
    }
}

/// Errors common to all points, computed at some of them.
pub(crate) struct CommonErrors {
    /// By order: sample, common error along the normal (mm), and contribution of the calibration to σ along the ray (mm).
    by_order: BTreeMap<i8, Vec<(u32, f32, f32)>>,
    pub(crate) is_known: bool,
    pub(crate) has_failed: bool,
}

impl CommonErrors {
    pub(crate) fn new(
        samples: &Samples,
        nominal: &Nominal,
        calibration: Option<&Calibration>,
        alignment: &ComparisonPose,
        reach_mm: f64,
    ) -> Result<Self, MeasureError> {
        let mut shared = Self { by_order: BTreeMap::new(), is_known: false, has_failed: false };
        let Some(calibration) = calibration else { return Ok(shared) };
        let few = thinned(&samples.indices(), COMPARED_SYSTEMATIC_POINTS);
        // The surface affects only the weights, which are not used.
        let facing = Shape::Plane { point_mm: Vector3::zeros(), normal: Vector3::z() };
        let seen = Retriangulation::of_sets(samples, &[(&few, &facing)], COMPARED_SYSTEMATIC_POINTS, calibration)?;
        let pixels = seen.pixels(0);
        let fit_points: Vec<FitPoint> = pixels.iter().map(|pixel| fit_point(samples, pixel.sample_idx)).collect();
        let rows = best_fit::rows(
            nominal,
            &fit_points,
            &alignment.pose,
            (&alignment.middle, alignment.lever_mm),
            reach_mm,
        );
        let positions = |variant: &Variant| -> Vec<Option<Vector3<f64>>> {
            pixels.iter().map(|pixel| seen.part_position(variant, pixel)).collect()
        };
        let base = positions(seen.unperturbed());
        let mut squares = vec![0.0; rows.len()];
        // The re-triangulated points are a subset of those of the fit: the same equations, fewer rows.
        let inverse = alignment.fit.map(|fit| {
            let hessian = best_fit::normal_equations(&rows).0;
            let held = fit.inverse.symmetric_eigen();
            let basis: Vec<Vector6<f64>> = (0..6)
                .filter(|k| held.eigenvalues[*k] > 1e-9 * held.eigenvalues.max())
                .map(|k| held.eigenvectors.column(k).into_owned())
                .collect();
            restricted_inverse(&hessian, &basis)
        });
        for (mode, pair) in seen.variants().iter().enumerate() {
            for (side, variant) in pair.iter().enumerate() {
                let along: Vec<Option<f64>> = positions(variant)
                    .iter()
                    .zip(&base)
                    .zip(&rows)
                    .map(|((moved, base), row)| {
                        let way = alignment.pose.rotation * ((*moved)? - (*base)?);
                        Some(row.as_ref()?.normal.dot(&way))
                    })
                    .collect();
                let step = match (&inverse, alignment.datums) {
                    (Some(inverse), _) => {
                        let pull = |(row, along): (&Option<Row>, &Option<f64>)| {
                            row.as_ref().zip(*along).map(|(row, along)| row.slopes * (row.weight * along))
                        };
                        Some(-(inverse * rows.iter().zip(&along).filter_map(pull).sum::<Vector6<f64>>()))
                    }
                    (None, Some(datums)) => datums.step(mode, side, &alignment.middle, alignment.lever_mm),
                    (None, None) => Some(Vector6::zeros()),
                };
                let Some(step) = step else {
                    shared.has_failed = true;
                    continue;
                };
                for ((square, row), along) in squares.iter_mut().zip(&rows).zip(&along) {
                    if let (Some(row), Some(along)) = (row, along) {
                        *square += (along + row.slopes.dot(&step)).powi(2) / 2.0;
                    }
                }
            }
        }
        for ((pixel, row), square) in pixels.iter().zip(&rows).zip(&squares) {
            if row.is_some() {
                let of_order = shared.by_order.entry(pixel.order()).or_default();
                of_order.push((pixel.sample_idx, square.sqrt() as f32, pixel.systematic_sigma_mm() as f32));
            }
        }
        shared.is_known = true;
        Ok(shared)
    }

    /// At the nearest sample of the same order: the common error along the normal, and the calibration's contribution to σ.
    fn at(&self, samples: &Samples, idx: u32) -> (f32, f32) {
        let Some(known) = self.by_order.get(&samples.point(idx).order) else { return (0.0, 0.0) };
        let after = known.partition_point(|(at, ..)| *at < idx);
        let beside = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|k| known.get(k));
        let nearest = beside.min_by_key(|(at, ..)| at.abs_diff(idx));
        nearest.map_or((0.0, 0.0), |(_, along_mm, of_sigma_mm)| (*along_mm, *of_sigma_mm))
    }
}

/// Standard uncertainty of a deviation, mm (eq. 17).
#[derive(Clone, Copy)]
pub(crate) struct Budget {
    pub(crate) noise_mm: f32,
    pub(crate) shared_mm: f32,
}

pub(crate) fn budget(
    samples: &Samples,
    nominal: &Nominal,
    alignment: &ComparisonPose,
    shared: &CommonErrors,
    of_pose: &Matrix6<f64>,
    point: &ComparedPoint,
) -> Budget {
    let (along_mm, of_sigma_mm) = shared.at(samples, point.sample);
    let total = samples.at(point.sample).sigma_mm as f32;
    let own = (total * total - of_sigma_mm * of_sigma_mm).max(0.0).sqrt().max(MIN_NOISE_RATIO as f32 * total);
    let facet = point.facet as usize;
    let slopes = slopes(&point.at.cast(), &nominal.facets[facet].normal, &alignment.middle, alignment.lever_mm);
    let pose = (slopes.transpose() * of_pose * slopes)[(0, 0)].max(0.0);
    let line_sigma_mm = samples.line_sigma_mm.unwrap_or(0.0);
    let thickness = FOOTPRINT_FACTOR * line_sigma_mm * line_sigma_mm * f64::from(nominal.curvature[facet]) / 2.0;
    let square =
        f64::from(along_mm).powi(2) + pose + thickness * thickness + f64::from(nominal.sag_mm[facet]).powi(2);
    Budget { noise_mm: own * point.cosine, shared_mm: square.sqrt() as f32 }
}
