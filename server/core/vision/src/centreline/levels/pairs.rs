//! Two lines so close to each other that no valley shows between them, by the shape of their light.

use super::super::lines::taps::WIDTH_PER_SIGMA;
use super::super::{CentrelinePoint, Centrelines};
use crate::params::{PAIR_HEIGHTS, PAIR_MISFIT, PAIR_WIDTHS, TYPICAL_EXCESS_PX2};

/// Light across a line, averaged along it.
pub struct Light {
    /// Row by row; empty if too little was averaged.
    pub profile: Vec<f32>,
    /// Full width at half height, rows.
    pub width_px: f32,
}

/// Middles tried, in widths of the light.
const MIDDLES: i32 = 4;
const MIDDLE_STEP: f32 = 0.04;
/// Widths tried, relative to the expected one.
const WIDTHS: i32 = 10;
const WIDTH_STEP: f32 = 0.03;
/// Distances of the pair tried, in widths: a closer one has the shape of one line.
const DISTANCES: std::ops::Range<i32> = 18..33;
const DISTANCE_STEP: f32 = 0.05;

/// Columns over which the width of a line is looked at, and how many of them.
const STRETCH: usize = 64;
const EVERY: usize = 8;

/// Full width at half height of the typical line, from the width as measured.
fn line_width(typical_px: f32) -> f32 {
    (typical_px * typical_px - TYPICAL_EXCESS_PX2).max(1.0).sqrt()
}

/// Whether any line is wide enough over some columns to be two typical ones.
pub fn may_hold_pairs(found: &Centrelines, typical_px: f32) -> bool {
    let widest_px = PAIR_WIDTHS.start * line_width(typical_px);
    let is_wide = |points: &[CentrelinePoint]| {
        let some = points.iter().step_by(EVERY);
        some.map(|point| point.width_px - widest_px).sum::<f32>() > 0.0
    };
    found.segments.iter().any(|segment| segment.points.chunks(STRETCH).any(is_wide))
}

/// Whether light is better explained by two lines of the image's typical width than by one line of any width.
/// `typical_px`: the typical width as measured.
pub fn is_pair(light: &Light, typical_px: f32) -> bool {
    let line_px = line_width(typical_px);
    if light.profile.is_empty() || !PAIR_WIDTHS.contains(&(light.width_px / line_px)) {
        return false;
    }
    let half = (light.profile.len() / 2) as f32;
    let middles = || (-MIDDLES..=MIDDLES).map(|k| half + k as f32 * MIDDLE_STEP * light.width_px);
    let bell = |middle: f32, width_px: f32| -> Vec<f32> {
        let per_sigma = WIDTH_PER_SIGMA / width_px;
        let at = |row: usize| (-0.5 * ((row as f32 - middle) * per_sigma).powi(2)).exp();
        (0..light.profile.len()).map(at).collect()
    };
    let widths = (-WIDTHS..=WIDTHS).map(|k| light.width_px * (1.0 + k as f32 * WIDTH_STEP));
    let ones = widths.flat_map(|width_px| middles().map(move |middle| (middle, width_px)));
    let one = ones.filter_map(|(middle, width_px)| misfit(&light.profile, &[bell(middle, width_px)]));
    let of_one = one.map(|(misfit, _)| misfit).fold(f32::INFINITY, f32::min);
    let mut of_two = f32::INFINITY;
    for distance_px in DISTANCES.map(|k| k as f32 * DISTANCE_STEP * line_px) {
        for middle in middles() {
            let two = [-0.5, 0.5].map(|side| bell(middle + side * distance_px, line_px));
            let Some((misfit, heights)) = misfit(&light.profile, &two) else { continue };
            let (low, high) = (heights[0].min(heights[1]), heights[0].max(heights[1]));
            if low > 0.0 && high <= PAIR_HEIGHTS * low {
                of_two = of_two.min(misfit);
            }
        }
    }
    of_two < PAIR_MISFIT * of_one
}

/// Sum of squares that a constant and some shapes (one or two) leave of a profile, and the shapes' heights; `None` if
/// the shapes cannot be told apart.
fn misfit(profile: &[f32], shapes: &[Vec<f32>]) -> Option<(f32, [f32; 2])> {
    let n = profile.len() as f64;
    let mean = |values: &[f32]| values.iter().map(|&value| f64::from(value)).sum::<f64>() / n;
    let of_profile = mean(profile);
    let means: Vec<f64> = shapes.iter().map(|shape| mean(shape)).collect();
    // Products of what is left of each without its mean.
    let product = |a: &[f32], of_a: f64, b: &[f32], of_b: f64| -> f64 {
        a.iter().zip(b).map(|(&a, &b)| (f64::from(a) - of_a) * (f64::from(b) - of_b)).sum()
    };
    let total = product(profile, of_profile, profile, of_profile);
    let right: Vec<f64> =
        shapes.iter().zip(&means).map(|(shape, &of)| product(shape, of, profile, of_profile)).collect();
    let square = |k: usize| product(&shapes[k], means[k], &shapes[k], means[k]);
    let heights = match shapes.len() {
        1 => [right[0] / square(0), 0.0],
        _ => {
            let (a, b, c) = (square(0), product(&shapes[0], means[0], &shapes[1], means[1]), square(1));
            let determinant = a * c - b * b;
            if determinant <= 1e-6 * a * c {
                return None;
            }
            [(c * right[0] - b * right[1]) / determinant, (a * right[1] - b * right[0]) / determinant]
        }
    };
    let explained: f64 = heights.iter().zip(&right).map(|(height, right)| height * right).sum();
    Some(((total - explained) as f32, heights.map(|height| height as f32)))
}
