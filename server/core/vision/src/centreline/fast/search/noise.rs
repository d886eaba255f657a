//! Noise level of the image, tile by tile, from a few columns of each.

use super::cells::Strip;
use crate::centreline::lines::candidates::Boxes;
use crate::centreline::lines::noise::NoiseMap;
use crate::centreline::spread::sigma_of;
use crate::centreline::view::{Level, Sum, View};
use crate::params::{NOISE_COLUMNS, NOISE_FLOOR, NOISE_OVER_NEIGHBOURS, NOISE_STRIDE_PX, NOISE_TILE_PX};

/// Rows sampled in a tile.
const N_ROWS: usize = NOISE_TILE_PX / NOISE_STRIDE_PX;

/// Sums of one row of samples.
type Row<T> = [<T as Level>::Sum; NOISE_COLUMNS];

/// Row distance of the pixels compared.
const PIXELS_APART: usize = 2;

/// Noise of pixels from differences two rows apart, measured one row of tiles at a time; its memory is reused from
/// image to image.
#[derive(Default)]
pub struct PixelNoise<T: Level> {
    /// Median of the previous tile, as the starting guess for the next.
    median: T,
    map: NoiseMap,
}

impl<T: Level> PixelNoise<T> {
    /// Clears the tiles of the previous image.
    pub fn begin(&mut self, view: &View<T>) {
        self.median = T::default();
        self.map.begin(view.width.div_ceil(NOISE_TILE_PX));
    }

    /// Measures the tiles whose first row is `v0`; rows of tiles come in order.
    #[inline(always)]
    pub fn measure(&mut self, view: &View<T>, v0: usize) {
        let floor = (NOISE_FLOOR * view.full_scale).max(view.hidden_noise);
        for u0 in (0..view.width).step_by(NOISE_TILE_PX) {
            let sigma = self.sigma(view, u0, v0) / 2.0f32.sqrt();
            self.map.push(sigma.max(floor));
        }
    }

    /// The spread of differences in the tile that begins at column `u0` and row `v0`.
    #[inline(always)]
    fn sigma(&mut self, view: &View<T>, u0: usize, v0: usize) -> f32 {
        let v1 = (v0 + NOISE_TILE_PX).min(view.height - PIXELS_APART);
        let u = columns_of_tile(view, u0);
        let mut tile = [[T::default(); NOISE_COLUMNS]; N_ROWS];
        let mut n = 0;
        for (row, v) in tile.iter_mut().zip((v0..v1).step_by(NOISE_STRIDE_PX)) {
            *row = row_differences(levels(view, u, v), levels(view, u, v + PIXELS_APART));
            n += 1;
        }
        sigma_of(&tile[..n], &mut self.median)
    }

    /// The tiles measured so far.
    pub fn map(&self) -> &NoiseMap {
        &self.map
    }
}

/// Noise of the difference of two box means, as the search for candidates compares them: measured in tiles whose strips
/// hold light, elsewhere that of independent pixels. Its memory is reused from image to image.
#[derive(Default)]
pub struct BoxNoise<T: Level> {
    tiles: Tiles<T>,
    measured: NoiseMap,
    /// Column and row of tiles whose noise is so large that it may be a line.
    suspicious: Vec<(usize, usize)>,
    map: NoiseMap,
}

impl<T: Level> BoxNoise<T> {
    /// Measures an image. The tiles around suspicious ones are measured as well.
    #[inline(always)]
    pub fn measure(&mut self, view: &View<T>, boxes: Boxes, pixels: &NoiseMap, strips: &[Strip]) {
        let Self { tiles, measured, suspicious, map } = self;
        let n_rows = boxes.rows();
        let per_row = 1.0 / n_rows as f32;
        let of_independent = (2.0 * per_row).sqrt();
        let (across, down) = (view.width.div_ceil(NOISE_TILE_PX), view.height.div_ceil(NOISE_TILE_PX));
        tiles.begin(n_rows, boxes.flank);
        let sigmas = measured.begin(across);
        sigmas.resize(across * down, UNMEASURED);
        suspicious.clear();
        for strip in strips {
            let column = strip.u0 / NOISE_TILE_PX;
            for rows in &strip.rows {
                for row in rows.start / NOISE_TILE_PX..rows.end.div_ceil(NOISE_TILE_PX) {
                    sigmas[row * across + column] = PENDING;
                }
            }
        }
        // From the last row up: the image was just read to its end, so its last rows are still cached.
        for (place, sigma) in sigmas.iter_mut().enumerate().rev().filter(|(_, sigma)| **sigma == PENDING) {
            let (column, row) = (place % across, place / across);
            *sigma = tiles.sigma(view, column * NOISE_TILE_PX, row * NOISE_TILE_PX) * per_row;
            let limit = NOISE_OVER_NEIGHBOURS * of_independent * pixels.least_around(column, row);
            if *sigma > limit {
                // Lines close to each other look the same a few columns further; noise and texture do not.
                *sigma = sigma.min((tiles.sigma_along() * per_row).max(limit));
                suspicious.push((column, row));
            }
        }
        for &(column, row) in &*suspicious {
            for r in row.saturating_sub(1)..(row + 2).min(down) {
                for c in column.saturating_sub(1)..(column + 2).min(across) {
                    if sigmas[r * across + c] == UNMEASURED {
                        sigmas[r * across + c] = tiles.sigma(view, c * NOISE_TILE_PX, r * NOISE_TILE_PX) * per_row;
                    }
                }
            }
        }
        measured.limit_by_neighbours(suspicious, map);
        map.raise_to(pixels, of_independent);
    }

    /// The noise of the image measured last.
    pub fn map(&self) -> &NoiseMap {
        &self.map
    }
}

/// Marks a tile that is not measured: less than any noise.
const UNMEASURED: f32 = -1.0;
/// Marks a tile that is about to be measured.
const PENDING: f32 = -2.0;

/// Columns between two boxes compared side by side: wider than a speckle grain, and short enough that a steep line has
/// not moved far.
const BOXES_BESIDE: usize = 4;

/// Measures, tile by tile, the robust spread of the difference between the sums of two boxes of `n_rows` rows, one
/// `apart` rows below the other.
#[derive(Default)]
struct Tiles<T: Level> {
    n_rows: usize,
    apart: usize,
    /// Median of the previous tile, as the starting guess for the next.
    median: u16,
    sums: Vec<Row<T>>,
    /// Index of the first sum of each sampled column of the last tile.
    firsts: Vec<usize>,
}

impl<T: Level> Tiles<T> {
    fn begin(&mut self, n_rows: usize, apart: usize) {
        (self.n_rows, self.apart, self.median) = (n_rows, apart, 0);
        self.sums.resize(NOISE_TILE_PX + apart + n_rows, [T::Sum::default(); NOISE_COLUMNS]);
    }

    /// The spread in the tile that begins at column `u0` and row `v0`.
    #[inline(always)]
    fn sigma(&mut self, view: &View<T>, u0: usize, v0: usize) -> f32 {
        let Self { n_rows, apart, .. } = *self;
        let v1 = (v0 + NOISE_TILE_PX).min(view.height.saturating_sub(apart + n_rows - 1));
        let mut tile = [[0; NOISE_COLUMNS]; N_ROWS];
        self.firsts.clear();
        self.firsts.extend((v0..v1).step_by(NOISE_STRIDE_PX).map(|v| v - v0));
        let n = self.firsts.len();
        let last = (v0 + NOISE_TILE_PX + apart + n_rows - 1).min(view.height);
        sum_up(view, columns_of_tile(view, u0), v0..last, &mut self.sums);
        for (row, &first) in tile.iter_mut().zip(&self.firsts) {
            let sums = &self.sums[first..=first + apart + n_rows];
            *row = box_differences::<T>([&sums[0], &sums[n_rows], &sums[apart], &sums[apart + n_rows]]);
        }
        sigma_of(&tile[..n], &mut self.median)
    }

    /// The spread of the difference between the sums of two boxes side by side, [`BOXES_BESIDE`] columns apart, in the
    /// same tile.
    fn sigma_along(&self) -> f32 {
        const N_PAIRS: usize = NOISE_COLUMNS - BOXES_BESIDE;
        let mut tile = [[0; NOISE_COLUMNS]; N_ROWS];
        for (row, &first) in tile.iter_mut().zip(&self.firsts) {
            let (from, to) = (&self.sums[first], &self.sums[first + self.n_rows]);
            for (i, difference) in row.iter_mut().enumerate() {
                // A row of differences has more elements than there are pairs.
                let (here, beside) = (i % N_PAIRS, i % N_PAIRS + BOXES_BESIDE);
                *difference = to[here].minus(from[here]).minus(to[beside].minus(from[beside])).saturating_abs();
            }
        }
        sigma_of(&tile[..self.firsts.len()], &mut self.median.clone())
    }
}

/// The first column sampled in the tile that begins at column `u0`.
#[inline(always)]
fn columns_of_tile<T>(view: &View<T>, u0: usize) -> usize {
    (u0 + (NOISE_TILE_PX - NOISE_COLUMNS) / 2).min(view.width - NOISE_COLUMNS)
}

/// The sampled columns of a row.
#[inline(always)]
fn levels<'a, T>(view: &'a View<T>, u: usize, v: usize) -> &'a [T; NOISE_COLUMNS] {
    view.pixels[v * view.width + u..].first_chunk().expect("the columns lie in every row")
}

/// Running sums over neighbouring columns from `u` on, from the first row to every row.
#[inline(always)]
fn sum_up<T: Level>(view: &View<T>, u: usize, rows: std::ops::Range<usize>, sums: &mut [Row<T>]) {
    let mut sum = [T::Sum::default(); NOISE_COLUMNS];
    sums[0] = sum;
    let mut place = rows.start * view.width + u;
    for out in &mut sums[1..=rows.len()] {
        let row = &view.pixels[place..place + NOISE_COLUMNS];
        for i in 0..NOISE_COLUMNS {
            sum[i] = sum[i].plus(row[i].sum());
        }
        *out = sum;
        place += view.width;
    }
}

/// Absolute differences of two rows of levels.
#[inline(always)]
fn row_differences<T: Level>(upper: &[T; NOISE_COLUMNS], lower: &[T; NOISE_COLUMNS]) -> [T; NOISE_COLUMNS] {
    let mut row = *upper;
    for i in 0..NOISE_COLUMNS {
        row[i] = row[i].abs_difference(lower[i]);
    }
    row
}

/// Absolute differences of two boxes, from the running sums before and after each. Differences of noise fit in 16 bits.
#[inline(always)]
fn box_differences<T: Level>([from, to, other_from, other_to]: [&Row<T>; 4]) -> [u16; NOISE_COLUMNS] {
    let mut row = [0; NOISE_COLUMNS];
    for i in 0..NOISE_COLUMNS {
        row[i] = to[i].minus(from[i]).minus(other_to[i].minus(other_from[i])).saturating_abs();
    }
    row
}
