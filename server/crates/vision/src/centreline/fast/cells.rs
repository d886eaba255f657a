//! Where lines can be: cells of 8 × 4 pixels brighter than what lies above and below them.
//!
//! This is the only look at every pixel. A cell averages 32 pixels, so that a line at the limit of detection in one
//! column stands out clearly; the threshold is low, for a cell too many costs time only.

use crate::centreline::reference::noise::NoiseMap;
use crate::centreline::view::{CELL_BLOCK, Level, Sum, View};
use crate::params::{
    CELL_HEIGHT_PX, CELL_MIN_SNR, CELL_WIDTH_PX, CELLS_AT_BORDER, CELLS_BESIDE, NOISE_TILE_PX, STRIP_WIDTH_PX,
};

/// Columns of cells in a strip.
const STRIP_CELLS: usize = STRIP_WIDTH_PX / CELL_WIDTH_PX;
/// Columns of cells compared side by side.
const LANES: usize = 16;

/// Columns of the image that share cells, and the rows in which they may hold lines.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Strip {
    /// First column.
    pub u0: usize,
    /// One past the last column.
    pub u1: usize,
    /// Rows, in order, apart from each other.
    pub rows: Vec<std::ops::Range<usize>>,
}

/// Sums of cells side by side.
type Sums<T> = [<T as Level>::Sum; LANES];

/// Looks for bright cells; keeps its memory from image to image.
#[derive(Default)]
pub struct Cells<T: Level> {
    /// Cells in a row.
    across: usize,
    /// Rows of cells.
    down: usize,
    /// Groups of [`LANES`] cells in a row.
    groups: usize,
    /// Sums of grey levels, row by row of cells. Where the image does not hold a whole number of cells, the last ones
    /// overlap those before.
    sums: Vec<Sums<T>>,
    /// One group of columns with as many rows beyond either end as a comparison looks at.
    levels: Vec<Sums<T>>,
    least: Vec<Sums<T>>,
    /// A bit for every cell, by column.
    bright: Vec<u64>,
}

impl<T: Level> Cells<T> {
    /// The strips of an image, summed up before, with the rows in which lines may be.
    #[inline(always)]
    pub fn strips_with_light(&mut self, view: &View<T>, noise: &NoiseMap, strips: &mut Vec<Strip>) {
        let words = self.down.div_ceil(64);
        self.bright.clear();
        self.bright.resize(self.groups * LANES * words, 0);
        for group in 0..self.groups {
            self.mark_bright(group, noise, words);
        }
        let of_cells = |idx: usize| &self.bright[idx * words..(idx + 1) * words];
        strips.resize_with(self.across.div_ceil(STRIP_CELLS), Strip::default);
        for (strip, first) in strips.iter_mut().zip((0..self.across).step_by(STRIP_CELLS)) {
            let own = first..(first + STRIP_CELLS).min(self.across);
            let bits = |word: usize| own.clone().fold(0, |bits, idx| bits | of_cells(idx)[word]);
            strip.u0 = first * CELL_WIDTH_PX;
            strip.u1 = (strip.u0 + STRIP_WIDTH_PX).min(view.width);
            rows_of((0..words).map(bits), self.down, view.height, &mut strip.rows);
        }
    }

    /// Prepares for the sums over an image.
    pub fn begin(&mut self, view: &View<T>) {
        let (across, down) = (view.width.div_ceil(CELL_WIDTH_PX), view.height.div_ceil(CELL_HEIGHT_PX));
        (self.across, self.down, self.groups) = (across, down, across.div_ceil(LANES));
        self.sums.resize(self.groups * down, [T::Sum::default(); LANES]);
    }

    /// Sums up the cells that begin in some rows.
    #[inline(always)]
    pub fn sum_up(&mut self, view: &View<T>, rows: std::ops::Range<usize>) {
        let across = self.across;
        for row in rows.start.div_ceil(CELL_HEIGHT_PX)..rows.end.div_ceil(CELL_HEIGHT_PX) {
            let out = self.sums[row * self.groups..(row + 1) * self.groups].as_flattened_mut();
            out[across..].fill(T::Sum::default());
            let v = (row * CELL_HEIGHT_PX).min(view.height - CELL_HEIGHT_PX);
            let rows: [&[T]; CELL_HEIGHT_PX] = std::array::from_fn(|i| view.row(v + i));
            let [a, b, c, d] = rows.map(|r| r.as_chunks::<CELL_WIDTH_PX>().0);
            let some = [a, b, c, d].map(|row| row.as_chunks::<CELL_BLOCK>());
            let mut place = 0;
            for (((a, b), c), d) in some[0].0.iter().zip(some[1].0).zip(some[2].0).zip(some[3].0) {
                let sums = T::cell_sums([a, b, c, d]);
                out[place..place + CELL_BLOCK].copy_from_slice(&sums);
                place += CELL_BLOCK;
            }
            let rest = some.map(|(_, rest)| rest);
            for (i, out) in out[place..].iter_mut().enumerate().take(rest[0].len()) {
                *out = T::cell_sum([&rest[0][i], &rest[1][i], &rest[2][i], &rest[3][i]]);
            }
            if !view.width.is_multiple_of(CELL_WIDTH_PX) {
                let tails = rows.map(|r| r.last_chunk::<CELL_WIDTH_PX>().expect("rows are wider than cells"));
                out[across - 1] = T::cell_sum(tails);
            }
        }
    }

    /// Sets a bit for every cell of a group of columns that is brighter, by [`CELL_MIN_SNR`], than the darkest cell
    /// above and the darkest below it.
    #[inline(always)]
    fn mark_bright(&mut self, group: usize, noise: &NoiseMap, words: usize) {
        self.take(group);
        let scale = CELL_MIN_SNR * ((CELL_WIDTH_PX * CELL_HEIGHT_PX) as f32).sqrt();
        let n = LANES.min(self.across - group * LANES);
        let mut thresholds = [T::Sum::default(); LANES];
        let rows = self.levels[CELLS_BESIDE..].iter().zip(&self.least).zip(&self.least[CELLS_BESIDE + 1..]);
        for (row, ((here, above), below)) in rows.enumerate().take(self.down) {
            if (row * CELL_HEIGHT_PX).is_multiple_of(NOISE_TILE_PX) {
                let sigmas = noise.row(row * CELL_HEIGHT_PX);
                for (lane, threshold) in thresholds.iter_mut().enumerate().take(n) {
                    let sigma = sigmas[(group * LANES + lane) * CELL_WIDTH_PX / NOISE_TILE_PX];
                    *threshold = T::Sum::nearest(scale * sigma).plus(T::Sum::ONE);
                }
            }
            let above = if row < CELLS_AT_BORDER { below } else { above };
            let below = if row + CELLS_AT_BORDER >= self.down { above } else { below };
            let mut excess = *here;
            let mut most = T::Sum::default().minus(T::Sum::ONE);
            for lane in 0..LANES {
                let base = above[lane].max(below[lane]);
                excess[lane] = here[lane].minus(base).minus(thresholds[lane]);
            }
            for lane in 0..LANES {
                most = most.max(excess[lane]);
            }
            if most < T::Sum::default() {
                continue;
            }
            for lane in (0..n).filter(|&lane| excess[lane] >= T::Sum::default()) {
                self.bright[(group * LANES + lane) * words + row / 64] |= 1 << (row % 64);
            }
        }
    }

    /// Takes out a group of columns, and for every row of cells the least of it and the `CELLS_BESIDE − 1` that follow.
    #[inline(always)]
    fn take(&mut self, group: usize) {
        let beyond = [T::Sum::MAX; LANES];
        self.levels.clear();
        self.levels.resize(CELLS_BESIDE, beyond);
        self.levels.extend(self.sums[group..].iter().step_by(self.groups));
        self.levels.resize(self.down + 2 * CELLS_BESIDE, beyond);
        self.least.clone_from(&self.levels);
        let mut covered = 1;
        while covered < CELLS_BESIDE {
            let step = covered.min(CELLS_BESIDE - covered);
            for row in 0..self.least.len() - step {
                let further = self.least[row + step];
                let here = &mut self.least[row];
                for lane in 0..LANES {
                    here[lane] = here[lane].min(further[lane]);
                }
            }
            covered += step;
        }
    }
}

/// Runs of set bits, one cell longer at either end, as rows of pixels.
#[inline(always)]
fn rows_of(
    bits: impl Iterator<Item = u64>,
    n_cells: usize,
    height: usize,
    runs: &mut Vec<std::ops::Range<usize>>,
) {
    runs.clear();
    for (idx, word) in bits.enumerate() {
        let mut rest = word;
        while rest != 0 {
            let begin = rest.trailing_zeros();
            let length = (rest >> begin).trailing_ones();
            rest = if begin + length >= 64 { 0 } else { rest >> (begin + length) << (begin + length) };
            let from = (idx * 64 + begin as usize).saturating_sub(1);
            let to = (idx * 64 + (begin + length) as usize + 1).min(n_cells);
            let rows = from * CELL_HEIGHT_PX..(to * CELL_HEIGHT_PX).min(height);
            match runs.last_mut() {
                Some(last) if last.end >= rows.start => last.end = rows.end,
                _ => runs.push(rows),
            }
        }
    }
}
