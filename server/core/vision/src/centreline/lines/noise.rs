//! Noise level of the image, tile by tile.

use crate::params::{NOISE_OVER_NEIGHBOURS, NOISE_TILE_PX};

/// Standard deviations of noise (grey levels) in tiles over the image.
#[derive(Default)]
pub struct NoiseMap {
    sigmas: Vec<f32>,
    tiles_across: usize,
}

impl NoiseMap {
    /// Begins a new map and returns the tiles, row by row, to be filled; the memory of the previous map is reused.
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

    /// A broad line can fill most of a tile and resemble noise; the tiles above and below do not contain it. Each of
    /// the `suspicious` tiles (column, row) is limited to [`NOISE_OVER_NEIGHBOURS`] times the lower quartile of its
    /// surroundings in `limited`, which is otherwise a copy of this map.
    pub fn limit_by_neighbours(&self, suspicious: &[(usize, usize)], limited: &mut Self) {
        let sigmas = limited.begin(self.tiles_across);
        sigmas.extend_from_slice(&self.sigmas);
        for &(column, row) in suspicious {
            let mut least = Least::default();
            self.for_each_around(column, row, |sigma| least.add(sigma));
            let sigma = &mut sigmas[row * self.tiles_across + column];
            *sigma = sigma.min(NOISE_OVER_NEIGHBOURS * least.lower_quartile());
        }
    }

    /// The smallest noise of a tile and its neighbours.
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

    /// Noise at a pixel.
    pub fn at(&self, u: usize, v: usize) -> f32 {
        self.row(v)[u / NOISE_TILE_PX]
    }

    /// Noise of the tiles along row `v`; element `i` applies from column `i * NOISE_TILE_PX` on.
    pub fn row(&self, v: usize) -> &[f32] {
        let start = v / NOISE_TILE_PX * self.tiles_across;
        &self.sigmas[start..start + self.tiles_across]
    }
}

/// The three smallest of up to nine numbers, in order.
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
