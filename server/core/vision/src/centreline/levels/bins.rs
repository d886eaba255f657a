//! Binning of rows, and conversion of the points found to image coordinates.

use super::super::CentrelinePoint;
use super::super::view::{Level, View};

/// Averages 2^`shift` rows into one, scaled so that nothing is lost to rounding; returns the scale.
pub fn binned<T: Level>(view: &View<T>, shift: usize, pixels: &mut Vec<u16>) -> f32 {
    let rows = 1usize << shift;
    // The largest power of two that keeps full scale within sixteen bits.
    let gain_bits = (f32::from(u16::MAX) / view.full_scale).log2().floor() as u32;
    let half = 1 << shift >> 1;
    let mut sums = vec![0; view.width];
    pixels.clear();
    for row in 0..view.height >> shift {
        sums.fill(half);
        for v in row * rows..(row + 1) * rows {
            sums.iter_mut().zip(view.row(v)).for_each(|(sum, &level)| *sum += level.into() << gain_bits);
        }
        pixels.extend(sums.iter().map(|sum| (sum >> shift).min(u16::MAX.into()) as u16));
    }
    (1u32 << gain_bits) as f32
}

/// Converts a point of an image with `rows` rows binned into one, and grey levels `gain` times as large, to the
/// original image.
pub fn unbin(point: &mut CentrelinePoint, rows: usize, gain: f32) {
    let rows = rows as f64;
    let [along, across] = point.normal;
    let slope = -along / across * rows;
    let stretched = 1.0 / (1.0 + slope * slope).sqrt();
    point.v_px = (point.v_px + 0.5) * rows - 0.5;
    point.sigma_px *= rows * stretched / across;
    point.width_px *= (rows * stretched / across) as f32;
    point.normal = [-slope * stretched, stretched];
    point.intensity /= gain;
}
