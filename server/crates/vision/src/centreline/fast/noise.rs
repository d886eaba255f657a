//! Noise level of the image, tile by tile, from a few columns of each.

use crate::centreline::reference::candidates::Boxes;
use crate::centreline::reference::noise::NoiseMap;
use crate::centreline::view::{Level, Sum, View};
use crate::params::{NOISE_COLUMNS, NOISE_FLOOR, NOISE_STRIDE_PX, NOISE_TILE_PX};

/// Root mean square of a unit Gaussian cut at 3 · 0.6745 σ.
const CUT_RMS: f32 = 0.884;
/// Rows sampled in a tile.
const N_ROWS: usize = NOISE_TILE_PX / NOISE_STRIDE_PX;

/// Absolute differences of one row of samples.
type Row = [i32; NOISE_COLUMNS];
/// What a row holds where there is no difference: beyond every cut.
const NOTHING: Row = [i32::MAX; NOISE_COLUMNS];

/// Noise of pixels from differences two rows apart.
#[inline(always)]
pub fn of_pixels<T: Level>(view: &View<T>) -> NoiseMap {
    let floor = NOISE_FLOOR * view.full_scale;
    let mut map = measure(view, 1, 2);
    map.iter_mut().for_each(|sigma| *sigma = (*sigma / 2.0f32.sqrt()).max(floor));
    NoiseMap::from_sigmas(map, view.width.div_ceil(NOISE_TILE_PX))
}

/// Noise of the mean of one box against another, as the search for candidates compares them.
#[inline(always)]
pub fn of_boxes<T: Level>(view: &View<T>, boxes: Boxes, pixels: &NoiseMap) -> NoiseMap {
    let n_rows = boxes.rows();
    let mut map = measure(view, n_rows, boxes.flank);
    map.iter_mut().for_each(|sigma| *sigma /= n_rows as f32);
    let measured = NoiseMap::from_sigmas(map, view.width.div_ceil(NOISE_TILE_PX));
    measured.limited_by_neighbours().at_least(pixels, (2.0 / n_rows as f32).sqrt())
}

/// Robust spread in every tile of the difference between the sums of two boxes of `n_rows` rows, one `apart` rows below
/// the other.
#[inline(always)]
fn measure<T: Level>(view: &View<T>, n_rows: usize, apart: usize) -> Vec<f32> {
    let tiles_across = view.width.div_ceil(NOISE_TILE_PX);
    let mut sigmas = Vec::with_capacity(tiles_across * view.height.div_ceil(NOISE_TILE_PX));
    for v0 in (0..view.height).step_by(NOISE_TILE_PX) {
        let v1 = (v0 + NOISE_TILE_PX).min(view.height.saturating_sub(apart + n_rows - 1));
        for u0 in (0..view.width).step_by(NOISE_TILE_PX) {
            let u = (u0 + (NOISE_TILE_PX - NOISE_COLUMNS) / 2).min(view.width - NOISE_COLUMNS);
            let mut tile = [NOTHING; N_ROWS];
            let mut n = 0;
            for (row, v) in tile.iter_mut().zip((v0..v1).step_by(NOISE_STRIDE_PX)) {
                *row = difference(view, u, v, n_rows, apart);
                n += NOISE_COLUMNS;
            }
            sigmas.push(sigma_of(&tile, n));
        }
    }
    sigmas
}

/// Absolute differences of some neighbouring columns from `u` on.
#[inline(always)]
fn difference<T: Level>(view: &View<T>, u: usize, v: usize, n_rows: usize, apart: usize) -> Row {
    let mut sum = [T::Sum::default(); NOISE_COLUMNS];
    let upper = view.pixels[v * view.width + u..].chunks(view.width);
    let lower = view.pixels[(v + apart) * view.width + u..].chunks(view.width);
    for (a, b) in upper.zip(lower).take(n_rows) {
        let (a, b) = (&a[..NOISE_COLUMNS], &b[..NOISE_COLUMNS]);
        for i in 0..NOISE_COLUMNS {
            sum[i] = sum[i].plus(a[i].sum().minus(b[i].sum()));
        }
    }
    let mut row = NOTHING;
    for i in 0..NOISE_COLUMNS {
        row[i] = sum[i].int().abs();
    }
    row
}

/// Standard deviation of `n` absolute differences: the root mean square of those below three times the median (at
/// 2.02 σ for a Gaussian), which a line in the tile hardly touches.
#[inline(always)]
fn sigma_of(tile: &[Row; N_ROWS], n: usize) -> f32 {
    if n == 0 {
        return 0.0;
    }
    let cut = (3 * median_of(tile, n / 2)).max(3);
    let (mut sums, mut counts) = ([0.0f32; NOISE_COLUMNS], [0i32; NOISE_COLUMNS]);
    for row in tile {
        for i in 0..NOISE_COLUMNS {
            let inside = row[i] <= cut;
            let d = if inside { row[i] as f32 } else { 0.0 };
            sums[i] += d * d;
            counts[i] += i32::from(inside);
        }
    }
    (sums.iter().sum::<f32>() / (counts.iter().sum::<i32>() as f32).max(1.0)).sqrt() / CUT_RMS
}

/// The element of rank `rank` by counting: galloping up, then halving.
#[inline(always)]
fn median_of(tile: &[Row; N_ROWS], rank: usize) -> i32 {
    let mut high = 1;
    while n_up_to(tile, high) <= rank {
        high *= 2;
    }
    let mut low = if n_up_to(tile, 0) > rank { return 0 } else { high / 2 };
    // More than `rank` are at most `high`, no more than `rank` at most `low`.
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if n_up_to(tile, middle) > rank { high = middle } else { low = middle }
    }
    high
}

#[inline(always)]
fn n_up_to(tile: &[Row; N_ROWS], limit: i32) -> usize {
    let mut counts = [0i32; NOISE_COLUMNS];
    for row in tile {
        for i in 0..NOISE_COLUMNS {
            counts[i] += i32::from(row[i] <= limit);
        }
    }
    counts.iter().sum::<i32>() as usize
}
