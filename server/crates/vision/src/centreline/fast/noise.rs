//! Noise level of the image, tile by tile, from a few columns of each.

use crate::centreline::reference::candidates::Boxes;
use crate::centreline::reference::noise::NoiseMap;
use crate::centreline::view::{Level, View};
use crate::params::{NOISE_COLUMNS, NOISE_FLOOR, NOISE_STRIDE_PX, NOISE_TILE_PX};

/// Root mean square of a unit Gaussian cut at 3 · 0.6745 σ.
const CUT_RMS: f32 = 0.884;
/// Differences in a tile.
const N_SAMPLES: usize = NOISE_TILE_PX / NOISE_STRIDE_PX * NOISE_COLUMNS;
/// Numbers calculated side by side.
const LANES: usize = 8;

/// Noise of pixels from differences two rows apart.
#[inline(always)]
pub fn of_pixels<T: Level>(view: &View<T>) -> NoiseMap {
    let floor = NOISE_FLOOR * view.full_scale;
    let difference = |u: usize, v: usize| {
        let (a, b) = (sampled(view, u, v), sampled(view, u, v + 2));
        std::array::from_fn(|i| a[i].int() - b[i].int())
    };
    measure(view, 2, difference, |sigma| (sigma / 2.0f32.sqrt()).max(floor))
}

/// Noise of the mean of one box against another, as the search for candidates compares them.
#[inline(always)]
pub fn of_boxes<T: Level>(view: &View<T>, boxes: Boxes, pixels: &NoiseMap) -> NoiseMap {
    let n_rows = boxes.rows();
    let difference = |u: usize, v: usize| {
        let mut sum = [0; NOISE_COLUMNS];
        for k in v..v + n_rows {
            let (a, b) = (sampled(view, u, k), sampled(view, u, k + boxes.flank));
            (0..NOISE_COLUMNS).for_each(|i| sum[i] += a[i].int() - b[i].int());
        }
        sum
    };
    let measured = measure(view, boxes.flank + n_rows - 1, difference, |sigma| sigma / n_rows as f32);
    measured.limited_by_neighbours().at_least(pixels, (2.0 / n_rows as f32).sqrt())
}

#[inline(always)]
fn sampled<'a, T: Level>(view: &View<'a, T>, u: usize, v: usize) -> &'a [T; NOISE_COLUMNS] {
    let start = v * view.width + u;
    view.pixels[start..start + NOISE_COLUMNS].first_chunk().expect("the slice is as long")
}

/// Robust spread in every tile of differences between some neighbouring columns of some rows and of rows up to
/// `reach` further down.
#[inline(always)]
fn measure<T: Level>(
    view: &View<T>,
    reach: usize,
    difference: impl Fn(usize, usize) -> [i32; NOISE_COLUMNS],
    finish: impl Fn(f32) -> f32,
) -> NoiseMap {
    let tiles_across = view.width.div_ceil(NOISE_TILE_PX);
    let mut sigmas = Vec::with_capacity(tiles_across * view.height.div_ceil(NOISE_TILE_PX));
    for v0 in (0..view.height).step_by(NOISE_TILE_PX) {
        let v1 = (v0 + NOISE_TILE_PX).min(view.height.saturating_sub(reach));
        for u0 in (0..view.width).step_by(NOISE_TILE_PX) {
            let u = (u0 + (NOISE_TILE_PX - NOISE_COLUMNS) / 2).min(view.width - NOISE_COLUMNS);
            let mut tile = [i32::MAX; N_SAMPLES];
            let mut n = 0;
            for v in (v0..v1).step_by(NOISE_STRIDE_PX) {
                tile[n..n + NOISE_COLUMNS].copy_from_slice(&difference(u, v).map(i32::abs));
                n += NOISE_COLUMNS;
            }
            sigmas.push(finish(sigma_of(&tile, n)));
        }
    }
    NoiseMap::from_sigmas(sigmas, tiles_across)
}

/// Standard deviation of `n` absolute differences: the root mean square of those below three times the median (at
/// 2.02 σ for a Gaussian), which a line in the tile hardly touches. Places without a difference hold `i32::MAX`.
#[inline(always)]
fn sigma_of(tile: &[i32; N_SAMPLES], n: usize) -> f32 {
    if n == 0 {
        return 0.0;
    }
    let cut = (3 * median_of(tile, n / 2)).max(3);
    let (mut sums, mut counts) = ([0.0f32; LANES], [0.0f32; LANES]);
    for chunk in tile.as_chunks::<LANES>().0 {
        for i in 0..LANES {
            let inside = chunk[i] <= cut;
            let d = if inside { chunk[i] as f32 } else { 0.0 };
            sums[i] += d * d;
            counts[i] += if inside { 1.0 } else { 0.0 };
        }
    }
    (sums.iter().sum::<f32>() / counts.iter().sum::<f32>().max(1.0)).sqrt() / CUT_RMS
}

/// The element of rank `rank` by counting: galloping up, then halving.
#[inline(always)]
fn median_of(tile: &[i32; N_SAMPLES], rank: usize) -> i32 {
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
fn n_up_to(tile: &[i32; N_SAMPLES], limit: i32) -> usize {
    let mut counts = [0i32; LANES];
    for chunk in tile.as_chunks::<LANES>().0 {
        for i in 0..LANES {
            counts[i] += i32::from(chunk[i] <= limit);
        }
    }
    counts.iter().sum::<i32>() as usize
}
