//! Noise level of the image, tile by tile.

use super::candidates::Boxes;
use crate::centreline::view::{Level, View};
use crate::params::{NOISE_FLOOR, NOISE_OVER_NEIGHBOURS, NOISE_STRIDE_PX, NOISE_TILE_PX};

/// Standard deviations of noise (grey levels) in tiles over the image.
#[derive(Default)]
pub struct NoiseMap {
    sigmas: Vec<f32>,
    tiles_across: usize,
}

impl NoiseMap {
    /// Measures the noise of pixels from differences two rows apart: edges and lines fill only a small part of a
    /// tile, and slow changes of ambient light cancel.
    pub fn of_pixels<T: Level>(view: &View<T>) -> Self {
        let floor = NOISE_FLOOR * view.full_scale;
        let difference = |u: usize, v: usize| {
            (v + 2 < view.height)
                .then(|| view.pixels[v * view.width + u].int() - view.pixels[(v + 2) * view.width + u].int())
        };
        Self::measure(view, difference, |difference_sigma| (difference_sigma / 2.0f32.sqrt()).max(floor))
    }

    /// Measures the noise of the mean of one box against another, as the search for candidates compares them.
    /// Texture and compression make it larger than independent pixels would; it is never taken as smaller.
    pub fn of_boxes<T: Level>(view: &View<T>, boxes: Boxes, pixels: &NoiseMap) -> Self {
        let half = boxes.half_height;
        let sum = |u: usize, v: usize| -> i32 {
            (v - half..=v + half).map(|row| view.pixels[row * view.width + u].int()).sum()
        };
        let difference = |u: usize, v: usize| {
            let inside = v >= half && v + boxes.flank + half < view.height;
            inside.then(|| sum(u, v) - sum(u, v + boxes.flank))
        };
        let n_rows = boxes.rows() as f32;
        let measured = Self::measure(view, difference, |difference_sigma| difference_sigma / n_rows);
        let down = view.height.div_ceil(NOISE_TILE_PX);
        let all: Vec<_> =
            (0..down).flat_map(|row| (0..measured.tiles_across).map(move |column| (column, row))).collect();
        let mut limited = Self::default();
        measured.limit_by_neighbours(&all, &mut limited);
        limited.raise_to(pixels, (2.0 / n_rows).sqrt());
        limited
    }

    /// Begins a new map; gives the noise of every tile, row by row, to be filled in the memory of the map before.
    pub fn begin(&mut self, tiles_across: usize) -> &mut Vec<f32> {
        self.tiles_across = tiles_across;
        self.sigmas.clear();
        &mut self.sigmas
    }

    /// Adds the next tile.
    #[inline(always)]
    pub fn push(&mut self, sigma: f32) {
        self.sigmas.push(sigma);
    }

    /// Raises every tile that is below `least`, tile by tile.
    pub fn raise_to(&mut self, least: &NoiseMap, factor: f32) {
        for (sigma, least) in self.sigmas.iter_mut().zip(&least.sigmas) {
            *sigma = sigma.max(least * factor);
        }
    }

    /// A broad line can fill most of a tile and pass for noise; the tiles above and below know better. None of the
    /// `doubted` tiles (column, row) counts for more than [`NOISE_OVER_NEIGHBOURS`] times the lower quartile of its
    /// surroundings in `limited`, which becomes the same map otherwise.
    pub fn limit_by_neighbours(&self, doubted: &[(usize, usize)], limited: &mut Self) {
        let sigmas = limited.begin(self.tiles_across);
        sigmas.extend_from_slice(&self.sigmas);
        for &(column, row) in doubted {
            let mut least = Least::default();
            self.for_each_around(column, row, |sigma| least.add(sigma));
            let sigma = &mut sigmas[row * self.tiles_across + column];
            *sigma = sigma.min(NOISE_OVER_NEIGHBOURS * least.lower_quartile());
        }
    }

    /// The least noise of a tile and those around it.
    pub fn least_around(&self, column: usize, row: usize) -> f32 {
        let mut least = f32::INFINITY;
        self.for_each_around(column, row, |sigma| least = least.min(sigma));
        least
    }

    #[inline(always)]
    fn for_each_around(&self, column: usize, row: usize, mut look: impl FnMut(f32)) {
        let tiles_down = self.sigmas.len() / self.tiles_across;
        for r in row.saturating_sub(1)..(row + 2).min(tiles_down) {
            for c in column.saturating_sub(1)..(column + 2).min(self.tiles_across) {
                look(self.sigmas[r * self.tiles_across + c]);
            }
        }
    }

    /// Robust spread of `difference` in every tile, made a noise level by `finish`.
    fn measure<T: Level>(
        view: &View<T>,
        difference: impl Fn(usize, usize) -> Option<i32>,
        finish: impl Fn(f32) -> f32,
    ) -> Self {
        let tiles_across = view.width.div_ceil(NOISE_TILE_PX);
        let mut differences = Vec::with_capacity(NOISE_TILE_PX * NOISE_TILE_PX);
        let mut sigmas = Vec::with_capacity(tiles_across * view.height.div_ceil(NOISE_TILE_PX));
        for v0 in (0..view.height).step_by(NOISE_TILE_PX) {
            for u0 in (0..view.width).step_by(NOISE_TILE_PX) {
                differences.clear();
                for v in (v0..(v0 + NOISE_TILE_PX).min(view.height)).step_by(NOISE_STRIDE_PX) {
                    let columns = (u0..(u0 + NOISE_TILE_PX).min(view.width)).step_by(NOISE_STRIDE_PX);
                    differences.extend(columns.filter_map(|u| difference(u, v)).map(i32::abs));
                }
                sigmas.push(finish(sigma_of(&mut differences)));
            }
        }
        Self { sigmas, tiles_across }
    }

    /// Noise at a pixel.
    pub fn at(&self, u: usize, v: usize) -> f32 {
        self.row(v)[u / NOISE_TILE_PX]
    }

    /// Noise of the tiles along row `v`; element `i` holds for columns `i * NOISE_TILE_PX` and on.
    pub fn row(&self, v: usize) -> &[f32] {
        let start = v / NOISE_TILE_PX * self.tiles_across;
        &self.sigmas[start..start + self.tiles_across]
    }
}

/// The three least of up to nine numbers, in order.
struct Least {
    three: [f32; 3],
    n: usize,
}

impl Default for Least {
    fn default() -> Self {
        Self { three: [f32::INFINITY; 3], n: 0 }
    }
}

impl Least {
    #[inline(always)]
    fn add(&mut self, number: f32) {
        let [a, b, c] = self.three;
        self.three = [a.min(number), b.min(a.max(number)), c.min(b.max(number))];
        self.n += 1;
    }

    /// The element of rank n / 4.
    fn lower_quartile(&self) -> f32 {
        self.three[self.n / 4]
    }
}

/// Standard deviation of differences from their absolute values: the root mean square of those below
/// three times the median (at 2.02 σ for a Gaussian), which a line in the tile hardly touches.
fn sigma_of(differences: &mut [i32]) -> f32 {
    /// Root mean square of a unit Gaussian cut at 3 · 0.6745 σ.
    const CUT_RMS: f32 = 0.884;
    if differences.is_empty() {
        return 0.0;
    }
    let middle = differences.len() / 2;
    let median = *differences.select_nth_unstable(middle).1;
    let cut = (3 * median).max(3);
    let (sum, n) = differences
        .iter()
        .filter(|&&d| d <= cut)
        .fold((0.0f32, 0.0f32), |(sum, n), &d| (sum + (d as f32) * (d as f32), n + 1.0));
    (sum / n.max(1.0)).sqrt() / CUT_RMS
}
