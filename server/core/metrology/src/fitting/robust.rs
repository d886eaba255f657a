//! Robust fits: they converge to the inliers and count the outliers.

use rayon::prelude::*;
use statistics::{SIGMA_PER_MAD, median};

use crate::fitting::fit::{Points, Weighted, fit};
use crate::fitting::sample::{Sample, Samples, thinned};
use crate::interface::shape::Shape;
use crate::params::{MAX_TRIM_SIGMAS, MIN_FEATURE_POINTS, MIN_TRIM_SIGMAS, TRIM_POINTS, TRIM_ROUNDS, TRIM_SIGMAS};

/// The trim has converged when it changes by less than this fraction.
const TRIM_TOLERANCE: f64 = 0.01;

/// A fitted shape with the points it was fitted to.
#[derive(Debug, Clone)]
pub(crate) struct TrimmedFit {
    pub(crate) shape: Shape,
    /// Points within the trim.
    pub(crate) inliers: Vec<u32>,
    /// Trim, in units of the points' σ along the normal.
    pub(crate) trim: f64,
}

/// Distance of a point in units of its σ along the normal.
pub(crate) fn normalised_distance(shape: &Shape, sample: &Sample) -> f64 {
    shape.distance_mm(&sample.in_part.xyz) / sample.normal_sigma_mm(shape)
}

/// Points of a cloud with their weights for a fit near a shape.
pub(crate) struct Near<'a> {
    pub(crate) samples: &'a Samples<'a>,
    pub(crate) indices: &'a [u32],
    pub(crate) shape: &'a Shape,
}

impl Points for Near<'_> {
    fn len(&self) -> usize {
        self.indices.len()
    }

    fn at(&self, idx: usize) -> Weighted {
        let sample = self.samples.at(self.indices[idx]);
        let sigma_mm = sample.normal_sigma_mm(self.shape);
        Weighted { position: sample.in_part.xyz, ray: sample.ray, weight: 1.0 / (sigma_mm * sigma_mm) }
    }
}

pub(crate) fn within(samples: &Samples, candidates: &[u32], shape: &Shape, trim: f64) -> Vec<u32> {
    candidates
        .par_iter()
        .copied()
        .filter(|&idx| normalised_distance(shape, &samples.at(idx)).abs() <= trim)
        .collect()
}

/// Alternates fitting and trimming until the trim is 3.5 robust standard deviations of the residuals it keeps.
///
/// The trim grows when the residuals fill it, so that a start on part of a feature converges to all of it. The trim is
/// determined on a thinned set; the final fit uses all points if `fit_all`.
pub(crate) fn fit_trimmed(
    samples: &Samples,
    candidates: &[u32],
    start: &Shape,
    start_trim: f64,
    fit_all: bool,
) -> Option<TrimmedFit> {
    let few = thinned(candidates, TRIM_POINTS);
    let mut shape = *start;
    let mut trim = start_trim;
    for _ in 0..TRIM_ROUNDS {
        let (next, next_trim) = round(samples, &few, &shape, trim)?;
        let trimmed = (next_trim / trim - 1.0).abs() < TRIM_TOLERANCE;
        (shape, trim) = (next, next_trim);
        if trimmed {
            break;
        }
    }
    if fit_all && few.len() < candidates.len() {
        (shape, trim) = round(samples, candidates, &shape, trim)?;
    }
    let inliers = within(samples, candidates, &shape, trim);
    (inliers.len() >= MIN_FEATURE_POINTS).then_some(TrimmedFit { shape, inliers, trim })
}

fn round(samples: &Samples, candidates: &[u32], shape: &Shape, trim: f64) -> Option<(Shape, f64)> {
    let inliers = within(samples, candidates, shape, trim);
    let next = fit(shape, &Near { samples, indices: &inliers, shape })?;
    let mut residuals: Vec<f64> =
        inliers.par_iter().map(|&idx| normalised_distance(&next, &samples.at(idx)).abs()).collect();
    let scale = SIGMA_PER_MAD * median(&mut residuals).unwrap_or(0.0);
    Some((next, (TRIM_SIGMAS * scale).clamp(MIN_TRIM_SIGMAS, MAX_TRIM_SIGMAS)))
}
