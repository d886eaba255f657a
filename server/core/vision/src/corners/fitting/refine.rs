//! The accurate pass: every corner is fitted in the largest window that its squares allow.
//!
//! Directions and curvatures of the edges start from the whole board's smooth [`BoardWarp`]; position, blur and grey
//! levels are fitted per corner, so that the corners' errors are independent.

use std::collections::HashMap;

use rayon::prelude::*;
use statistics::{SIGMA_PER_MAD, median};

use crate::GreyImage;

use super::fit::{CornerFit, NoiseModel, Window, fit_corner, residuals, start_at};
use super::model::CrossShape;
use super::sums::CornerState;
use super::warp::{BoardWarp, LocalShape};
use super::window::{Reach, window_around};
use crate::corners::params::{
    DISAGREEMENT_MIN_SAMPLES, DISAGREEMENT_REACH, NOISE_SAMPLE_STEP, QUANTISATION_VARIANCE,
};

/// Refits all corners; `indices`: their (column, row), row by row.
///
/// A corner whose refit fails keeps its first fit, with its larger sigma.
pub fn refine(image: &GreyImage, first: &[CornerFit], indices: &[[usize; 2]], reach: Reach) -> Vec<CornerFit> {
    let Some(warp) = BoardWarp::fit(&indexed(first, indices)) else { return first.to_vec() };
    let all = (0..first.len()).into_par_iter();
    let started = |k: usize| {
        let local = warp.shape_at(place(indices[k]));
        let edges = with_board_edges(&local, &first[k]);
        let window = window_around(image, first[k].position_px, local.square_px, reach, Some(&edges));
        let start = start_at(&window, first[k].position_px, edges);
        (window, start)
    };
    let starts: Vec<(Window, Option<CornerState>)> = all.clone().map(started).collect();
    let noise = noise_from(&starts);
    let refit = |k: usize| {
        let (window, start) = &starts[k];
        start.and_then(|start| fit_corner(window, start, Some(&noise))).unwrap_or(first[k])
    };
    let mut fits: Vec<CornerFit> = all.map(refit).collect();
    add_disagreement(&mut fits, indices);
    fits
}

fn indexed(fits: &[CornerFit], indices: &[[usize; 2]]) -> Vec<([f64; 2], [f64; 2])> {
    indices.iter().zip(fits).map(|(index, fit)| (place(*index), fit.position_px)).collect()
}

fn place(index: [usize; 2]) -> [f64; 2] {
    index.map(|at| at as f64)
}

fn with_board_edges(local: &LocalShape, fit: &CornerFit) -> CrossShape {
    CrossShape {
        normal_rad: local.normal_rad,
        curvature_per_px: local.curvature_per_px,
        blur_px: fit.shape.blur_px,
    }
}

/// Variance as a function of grey level, from the residuals of all corners: a line through its values in the dark and
/// in the bright half (median absolute deviation, robust against dirt).
fn noise_from(starts: &[(Window, Option<CornerState>)]) -> NoiseModel {
    let known = starts.iter().filter_map(|(window, start)| Some((window, start.as_ref()?)));
    let mut samples: Vec<[f32; 2]> =
        known.flat_map(|(window, start)| residuals(window, start, NOISE_SAMPLE_STEP)).collect();
    let middle = samples.len() / 2;
    if middle == 0 {
        return NoiseModel { offset: QUANTISATION_VARIANCE, per_level: 0.0, floor: QUANTISATION_VARIANCE };
    }
    samples.select_nth_unstable_by(middle, |a, b| a[0].total_cmp(&b[0]));
    let (dark, bright) = samples.split_at(middle);
    let level = |half: &[[f32; 2]]| median_of(half.iter().map(|s| s[0]));
    let variance = |half: &[[f32; 2]]| {
        let deviation = SIGMA_PER_MAD * median_of(half.iter().map(|s| s[1].abs()));
        (deviation * deviation).max(QUANTISATION_VARIANCE)
    };
    let (x0, x1) = (level(dark), level(bright));
    let (y0, y1) = (variance(dark), variance(bright));
    let per_level = if x1 > x0 { ((y1 - y0) / (x1 - x0)).max(0.0) } else { 0.0 };
    NoiseModel { offset: y0 - per_level * x0, per_level, floor: (0.5 * y0.min(y1)).max(QUANTISATION_VARIANCE) }
}

/// Median; 0 if empty.
fn median_of(values: impl Iterator<Item = f32>) -> f64 {
    median(&mut values.collect::<Vec<f32>>()).map_or(0.0, f64::from)
}

/// Raises each sigma to the scatter of its neighbourhood: along rows and columns, the corners scatter about the smooth
/// board by more than the noise where print, sensor or an edge parallel to the pixel grid affects them.
///
/// Fourth differences of the deviation from the [`BoardWarp`] over five neighbours cancel everything smooth; with
/// weights 1, −4, 6, −4, 1 their variance is 70 σ². Boards with fewer than five corners in both directions have none.
fn add_disagreement(fits: &mut [CornerFit], indices: &[[usize; 2]]) {
    let Some(warp) = BoardWarp::fit(&indexed(fits, indices)) else { return };
    let deviation = |(index, fit): (&[usize; 2], &CornerFit)| {
        let smooth = warp.at(place(*index));
        [fit.position_px[0] - smooth[0], fit.position_px[1] - smooth[1]]
    };
    let deviations: Vec<[f64; 2]> = indices.iter().zip(fits.iter()).map(deviation).collect();
    let stencils = stencils(indices);
    for (index, fit) in indices.iter().zip(fits.iter_mut()) {
        let index = place(*index);
        let near = |s: &&Stencil| (0..2).all(|k| (s.centre[k] - index[k]).abs() <= DISAGREEMENT_REACH);
        let samples: Vec<f64> = stencils.iter().filter(near).flat_map(|s| s.variances(&deviations)).collect();
        if samples.len() >= DISAGREEMENT_MIN_SAMPLES {
            let variance = samples.iter().sum::<f64>() / samples.len() as f64;
            fit.sigma_px = fit.sigma_px.max(variance.sqrt());
        }
    }
}

/// Weights of the fourth difference, and its variance for unit variance.
const FOURTH_DIFFERENCE: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
const FOURTH_DIFFERENCE_VARIANCE: f64 = 70.0;

/// Five corners in a line.
struct Stencil {
    corners: [usize; 5],
    centre: [f64; 2],
}

impl Stencil {
    /// One estimate of the corners' variance per image axis (px²).
    fn variances(&self, deviations: &[[f64; 2]]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let difference: f64 =
                self.corners.iter().zip(FOURTH_DIFFERENCE).map(|(&n, w)| w * deviations[n][axis]).sum();
            difference * difference / FOURTH_DIFFERENCE_VARIANCE
        })
    }
}

/// Every five consecutive corners of a row or a column.
fn stencils(indices: &[[usize; 2]]) -> Vec<Stencil> {
    let by_index: HashMap<[usize; 2], usize> = indices.iter().enumerate().map(|(k, index)| (*index, k)).collect();
    let five = |[column, row]: [usize; 2], [by_column, by_row]: [usize; 2]| {
        let mut corners = [0; 5];
        for (s, corner) in corners.iter_mut().enumerate() {
            *corner = *by_index.get(&[column + s * by_column, row + s * by_row])?;
        }
        Some(Stencil { corners, centre: place([column + 2 * by_column, row + 2 * by_row]) })
    };
    indices.iter().flat_map(|&index| [five(index, [1, 0]), five(index, [0, 1])]).flatten().collect()
}
