//! Binning of rows, and conversion of the points found to image coordinates.

use super::super::CentrelinePoint;
use super::super::view::Level;

/// Averages pairs of rows of an image of this width, scaled so that as little as possible is lost to rounding; returns
/// the scale.
pub fn binned<T: Level>(image: &[T], width: usize, full_scale: f32, pixels: &mut Vec<u16>) -> f32 {
    // The largest power of two that keeps full scale within sixteen bits.
    let gain_bits = (f32::from(u16::MAX) / full_scale).log2().floor() as u32;
    let scaled = |level: T| level.into().min(u16::MAX >> gain_bits) << gain_bits;
    let mean = |a: u16, b: u16| ((u32::from(a) + u32::from(b) + 1) >> 1) as u16;
    pixels.clear();
    for pair in image.chunks_exact(2 * width) {
        let (upper, lower) = pair.split_at(width);
        pixels.extend(upper.iter().zip(lower).map(|(&upper, &lower)| mean(scaled(upper), scaled(lower))));
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
