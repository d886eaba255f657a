//! Width of the lines of an image: the median over prominent peaks in some columns of the lit strips.

use statistics::median;

use super::cells::Strip;
use crate::centreline::lines::noise::NoiseMap;
use crate::centreline::lines::width::collect_widths;
use crate::centreline::view::{Level, View};
use crate::params::{
    WIDTH_DEFAULT_PX, WIDTH_ENOUGH, WIDTH_FEW_COLUMNS, WIDTH_MAX_PX, WIDTH_MIN_PX, WIDTH_MIN_SNR, WIDTH_SEARCH_PX,
};

/// The peaks collected; their memory is reused from image to image.
#[derive(Default)]
pub struct Peaks {
    column: Vec<f32>,
    widths: Vec<f32>,
}

/// Typical full width at half height (pixels, along columns); [`WIDTH_DEFAULT_PX`] if there is no peak.
#[inline(always)]
pub fn typical_width_px<T: Level>(view: &View<T>, noise: &NoiseMap, strips: &[Strip], peaks: &mut Peaks) -> f32 {
    let Peaks { column, widths } = peaks;
    widths.clear();
    let step = (strips.len() / WIDTH_FEW_COLUMNS).max(1);
    let some = || strips.iter().skip(step / 2).step_by(step);
    // Every other column first, so that the sample covers the whole image.
    for strip in some().step_by(2).chain(some().skip(1).step_by(2)) {
        if widths.len() >= WIDTH_ENOUGH {
            break;
        }
        let u = (strip.u0 + strip.u1) / 2;
        for rows in &strip.rows {
            let from = rows.start.saturating_sub(WIDTH_SEARCH_PX + 2);
            let to = (rows.end + WIDTH_SEARCH_PX + 2).min(view.height);
            smoothed(view, u, from..to, column);
            collect_widths(column, |k| WIDTH_MIN_SNR * noise.at(u, from + k), widths);
        }
    }
    median(widths).map_or(WIDTH_DEFAULT_PX, |width_px| width_px.clamp(WIDTH_MIN_PX, WIDTH_MAX_PX))
}

/// Part of a column, averaged over three rows.
#[inline(always)]
fn smoothed<T: Level>(view: &View<T>, u: usize, rows: std::ops::Range<usize>, column: &mut Vec<f32>) {
    let at = |v: usize| view.grey(u, v.min(view.height - 1));
    column.resize(rows.len(), 0.0);
    let (mut before, mut here) = (at(rows.start.saturating_sub(1)), at(rows.start));
    let below = (rows.start + 1) * view.width + u;
    let inside = view.pixels[below.min(view.pixels.len())..].iter().step_by(view.width).map(|level| level.grey());
    for (mean, after) in column.iter_mut().zip(inside.chain([at(rows.end)])) {
        *mean = (before + here + after) * (1.0 / 3.0);
        (before, here) = (here, after);
    }
}
