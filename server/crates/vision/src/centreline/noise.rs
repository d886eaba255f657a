//! Noise level of the image, tile by tile.

use super::view::{Level, View};
use crate::params::{NOISE_FLOOR, NOISE_STRIDE_PX, NOISE_TILE_PX};

/// Standard deviation of the pixel noise (grey levels) in tiles over the image.
pub struct NoiseMap {
    sigmas: Vec<f32>,
    tiles_across: usize,
}

impl NoiseMap {
    /// Measures the noise from differences of pixels two rows apart: edges and lines fill only a small part
    /// of a tile, and slow changes of ambient light cancel.
    pub fn measure<T: Level>(view: &View<T>) -> Self {
        let tiles_across = view.width.div_ceil(NOISE_TILE_PX);
        let tiles_down = view.height.div_ceil(NOISE_TILE_PX);
        let floor = NOISE_FLOOR * view.full_scale;
        let mut differences = Vec::with_capacity(NOISE_TILE_PX * NOISE_TILE_PX);
        let mut sigmas = Vec::with_capacity(tiles_across * tiles_down);
        for tile_v in 0..tiles_down {
            for tile_u in 0..tiles_across {
                gather(view, tile_u * NOISE_TILE_PX, tile_v * NOISE_TILE_PX, &mut differences);
                sigmas.push(sigma_of(&mut differences).max(floor));
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

fn gather<T: Level>(view: &View<T>, u0: usize, v0: usize, differences: &mut Vec<i32>) {
    differences.clear();
    let (u1, v1) = ((u0 + NOISE_TILE_PX).min(view.width), (v0 + NOISE_TILE_PX).min(view.height));
    for v in (v0..v1.saturating_sub(2)).step_by(NOISE_STRIDE_PX) {
        let (near, far) = (&view.row(v)[u0..u1], &view.row(v + 2)[u0..u1]);
        let pairs = near.iter().zip(far).step_by(NOISE_STRIDE_PX);
        differences.extend(pairs.map(|(a, b)| (a.int() - b.int()).abs()));
    }
}

/// Standard deviation of one pixel from absolute differences of two: the root mean square of those below
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
    (sum / n.max(1.0) / 2.0).sqrt() / CUT_RMS
}
