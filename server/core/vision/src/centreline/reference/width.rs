//! How wide the lines of an image are, and how wide one crossing is.

use super::noise::NoiseMap;
use crate::centreline::view::{Level, View};
use crate::params::{
    WIDTH_DEFAULT_PX, WIDTH_MAX_PX, WIDTH_MIN_PX, WIDTH_MIN_SNR, WIDTH_SAMPLE_COLUMNS, WIDTH_SEARCH_PX,
};

/// Typical full width at half height (pixels, along columns) of the lines in the image: the median over
/// prominent peaks of some columns. [`WIDTH_DEFAULT_PX`] without any peak.
pub fn typical_width_px<T: Level>(view: &View<T>, noise: &NoiseMap) -> f32 {
    let step = (view.width / WIDTH_SAMPLE_COLUMNS).max(1);
    let mut column = vec![0.0f32; view.height];
    let mut widths = Vec::new();
    for u in (step / 2..view.width).step_by(step) {
        smoothed_column(view, u, &mut column);
        collect_widths(&column, |v| WIDTH_MIN_SNR * noise.at(u, v), &mut widths);
    }
    if widths.is_empty() {
        return WIDTH_DEFAULT_PX;
    }
    let middle = widths.len() / 2;
    let median = *widths.select_nth_unstable_by(middle, f32::total_cmp).1;
    median.clamp(WIDTH_MIN_PX, WIDTH_MAX_PX)
}

/// A column averaged over three rows.
fn smoothed_column<T: Level>(view: &View<T>, u: usize, column: &mut [f32]) {
    let last = view.height - 1;
    for (v, out) in column.iter_mut().enumerate() {
        let sum = view.grey(u, v.saturating_sub(1)) + view.grey(u, v) + view.grey(u, (v + 1).min(last));
        *out = sum / 3.0;
    }
}

/// Adds the widths of the prominent peaks of a column to `widths`.
#[inline(always)]
pub fn collect_widths(column: &[f32], min_prominence: impl Fn(usize) -> f32, widths: &mut Vec<f32>) {
    let floor = least(column);
    for v in peaks(column) {
        let peak = column[v];
        // No base is below the floor: what does not stand out from it need not be looked at.
        if peak - floor < min_prominence(v) {
            continue;
        }
        let above = &column[v.saturating_sub(WIDTH_SEARCH_PX)..v];
        let below = &column[v + 1..(v + 1 + WIDTH_SEARCH_PX).min(column.len())];
        let (Some(base_above), Some(base_below)) =
            (base_before_rise(above.iter().rev(), peak), base_before_rise(below.iter(), peak))
        else {
            continue;
        };
        let base = base_above.max(base_below);
        if peak - base < min_prominence(v) {
            continue;
        }
        let half = 0.5 * (peak + base);
        if let (Some(up), Some(down)) =
            (crossing(above.iter().rev(), peak, half), crossing(below.iter(), peak, half))
        {
            widths.push(up + down);
        }
    }
}

/// Rows no darker than the two above and the two below, in order. Noise has so many that a branch for every row would
/// be foretold wrongly most of the time.
#[inline(always)]
fn peaks(column: &[f32]) -> impl Iterator<Item = usize> {
    const ROWS: usize = 16;
    (2..column.len().saturating_sub(2)).step_by(ROWS).flat_map(move |first| {
        let mut near = [f32::INFINITY; ROWS + 4];
        let n = near.len().min(column.len() + 2 - first);
        near[..n].copy_from_slice(&column[first - 2..first - 2 + n]);
        let mut is_peak = [0u8; ROWS];
        for i in 0..ROWS {
            let peak = near[i + 2];
            let (above, below) = (near[i].max(near[i + 1]), near[i + 3].max(near[i + 4]));
            is_peak[i] = u8::from((peak > above) & (peak >= below) & (i + 4 < n));
        }
        let mut bits = u128::from_le_bytes(is_peak);
        std::iter::from_fn(move || {
            let next = (bits != 0).then(|| first + bits.trailing_zeros() as usize / 8);
            bits &= bits.wrapping_sub(1);
            next
        })
    })
}

/// The least of some numbers.
#[inline(always)]
fn least(numbers: &[f32]) -> f32 {
    let (some, rest) = numbers.as_chunks::<8>();
    let lower = |a: f32, b: f32| if b < a { b } else { a };
    let mut lanes = [f32::INFINITY; 8];
    for chunk in some {
        for (lane, &number) in lanes.iter_mut().zip(chunk) {
            *lane = if number < *lane { number } else { *lane };
        }
    }
    lanes.iter().chain(rest).copied().fold(f32::INFINITY, lower)
}

/// Lowest level met before the column rises above the peak (then the peak is not the line's own: `None`).
fn base_before_rise<'a>(levels: impl Iterator<Item = &'a f32>, peak: f32) -> Option<f32> {
    let mut base = f32::INFINITY;
    for &level in levels {
        if level > peak {
            return None;
        }
        base = base.min(level);
    }
    base.is_finite().then_some(base)
}

/// Distance (pixels) from a peak to where the levels walking away from it first fall below `half`.
fn crossing<'a>(levels: impl Iterator<Item = &'a f32>, peak: f32, half: f32) -> Option<f32> {
    let mut previous = peak;
    for (steps, &level) in levels.enumerate() {
        if level < half {
            return Some(steps as f32 + (previous - half) / (previous - level));
        }
        previous = level;
    }
    None
}

/// Full width at half height (pixels, along the column) of the crossing of column `u` at row `v`, with
/// `peak` and `base` grey levels; never more than `2 * reach` wide.
pub fn crossing_width_px<T: Level>(view: &View<T>, u: usize, v: usize, peak: f32, base: f32, reach: usize) -> f32 {
    let half = 0.5 * (peak + base);
    let side = |step: isize| {
        let mut previous = peak;
        for distance in 1..=reach {
            let row = v as isize + step * distance as isize;
            if row < 0 || row >= view.height as isize {
                return distance as f32 - 0.5;
            }
            let level = view.grey(u, row as usize);
            if level < half && distance > 1 || level < base + 0.35 * (peak - base) {
                let fraction =
                    if previous > level { ((previous - half) / (previous - level)).clamp(0.0, 1.0) } else { 0.5 };
                return (distance - 1) as f32 + fraction;
            }
            previous = level;
        }
        reach as f32
    };
    side(-1) + side(1)
}
