//! Blocks of sixteen steps of a trace, and the rows around which the image is sampled for them.

use super::taps::Taps;
use super::window::{LANES, Places, SHARING};
use crate::centreline::lines::candidates::Boxes;
use crate::centreline::lines::noise::NoiseMap;
use crate::centreline::lines::traces::Trace;
use crate::centreline::view::View;

/// One value per column of a block.
pub type Lanes = [f32; LANES];

/// Inputs for measuring the traces of an image.
#[derive(Clone, Copy)]
pub struct Image<'a, T> {
    /// The image.
    pub view: &'a View<'a, T>,
    /// Its noise.
    pub noise: &'a NoiseMap,
    /// Boxes of the detection, which define where the background is sampled.
    pub boxes: Boxes,
    /// Typical width of the lines.
    pub width_px: f32,
    /// Rows sampled on either side of a crossing.
    pub reach: usize,
    /// Derivative scales that fit within `reach`.
    pub scales: &'static [Taps],
}

impl<'a, T> Image<'a, T> {
    /// An image with lines of this typical width.
    pub fn new(view: &'a View<'a, T>, noise: &'a NoiseMap, boxes: Boxes, width_px: f32) -> Self {
        let kernel = Taps::for_width(width_px, Taps::scales(usize::MAX)).reach;
        let reach = kernel.max(boxes.flank + boxes.half_height);
        Self { view, noise, boxes, width_px, reach, scales: Taps::scales(reach) }
    }
}

/// A column that has not been measured yet.
#[derive(Clone, Copy, Default)]
pub struct Pending {
    pub idx: usize,
    pub v: u32,
}

/// The row nearest to a non-negative number: adding so large a number leaves no fractional digits.
#[inline(always)]
fn nearest_row(v: f32) -> u32 {
    const WHOLE: f32 = (1 << 23) as f32;
    (v + WHOLE).to_bits() - WHOLE.to_bits()
}

/// Assigns one common row to neighbouring columns with similar rows, so that their pixels are copied together. `idx`
/// numbers the groups of a trace.
#[inline(always)]
fn share_row(rows: &mut [u32; SHARING], idx: usize) {
    let n = SHARING as u32;
    // Halves are rounded up and down alternately, so that the choice of window does not bias the line.
    let mean = (rows.iter().sum::<u32>() + n / 2 - idx as u32 % 2) / n;
    let all_beside = rows.iter().fold(true, |all, row| all & ((row + 1).wrapping_sub(mean) <= 2));
    if all_beside {
        *rows = [mean; SHARING];
    }
}

/// Steps of a trace side by side; lanes beyond the last step repeat it.
pub struct Block {
    pub n: usize,
    pub places: Places,
    pub step_v: Lanes,
    pub contrast: Lanes,
    pub clearance_px: Lanes,
}

impl Block {
    /// Consecutive steps, starting at `first`. `last` is the last row of the image.
    #[inline(always)]
    pub fn from(trace: &Trace, first: usize, last: u32) -> Self {
        let (step_v, contrast) = (from(&trace.v[first..]), from(&trace.contrast[first..]));
        let clearance_px = from(&trace.clearance_px[first..]);
        let mut rows = [0; LANES];
        for i in 0..LANES {
            rows[i] = nearest_row(step_v[i]).min(last);
        }
        let n = LANES.min(trace.len() - first);
        for (idx, some) in rows.as_chunks_mut::<SHARING>().0.iter_mut().enumerate() {
            if (idx + 1) * SHARING <= n {
                share_row(some, first / SHARING + idx);
            }
        }
        let first_u = (trace.first_u + first) as u32;
        let mut u = [first_u; LANES];
        for i in 0..LANES {
            u[i] += i as u32;
        }
        let places = Places { u, v: rows, adjoin: true };
        Self { n, places, step_v, contrast, clearance_px }
    }

    /// The steps listed in `pending`, to be measured again.
    #[inline(always)]
    pub fn of(trace: &Trace, pending: &[Pending]) -> Self {
        let n = pending.len();
        let mut block = Self {
            n,
            places: Places { u: [0; LANES], v: [0; LANES], adjoin: false },
            step_v: [0.0; LANES],
            contrast: [0.0; LANES],
            clearance_px: [0.0; LANES],
        };
        for i in 0..LANES {
            let Pending { idx, v } = pending[i.min(n - 1)];
            block.places.u[i] = (trace.first_u + idx) as u32;
            block.places.v[i] = v;
            block.step_v[i] = trace.v[idx];
            block.contrast[i] = trace.contrast[idx];
            block.clearance_px[i] = trace.clearance_px[idx];
        }
        block
    }
}

/// The first numbers of a slice; the last one is repeated if there are too few.
#[inline(always)]
fn from(numbers: &[f32]) -> Lanes {
    match numbers.first_chunk() {
        Some(all) => *all,
        None => {
            let mut some = [numbers[numbers.len() - 1]; LANES];
            some[..numbers.len()].copy_from_slice(numbers);
            some
        }
    }
}
