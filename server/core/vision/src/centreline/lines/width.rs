//! Widths of the lines in a column.

use crate::params::WIDTH_SEARCH_PX;

/// Adds the widths of the prominent peaks of a column to `widths`.
#[inline(always)]
pub fn collect_widths(column: &[f32], min_prominence: impl Fn(usize) -> f32, widths: &mut Vec<f32>) {
    let floor = least(column);
    for v in peaks(column) {
        let peak = column[v];
        // No base is below the floor, so a peak that is not prominent above the floor is skipped.
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

/// Rows no darker than the two above and the two below, in order. Noise has so many that a branch per row would be
/// mispredicted most of the time.
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

/// The smallest of some numbers.
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

/// Lowest level before the column rises above the peak (then the peak is not the line's own: `None`).
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

/// Distance (px) from a peak to the position at which `levels`, in order away from the peak, first fall below `half`.
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
