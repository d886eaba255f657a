//! Regions that may contain lines: cells of 8 × 4 pixels brighter than the cells above and below them.
//!
//! This is the only pass over every pixel. A cell averages 32 pixels, so that a line at the detection limit of one
//! column stands out clearly. The threshold is low, because a false cell only costs time.

use crate::centreline::lines::noise::NoiseMap;
use crate::centreline::view::{Level, Sum, View};
use crate::params::{
    CELL_HEIGHT_PX, CELL_MARGIN_PX, CELL_MIN_SNR, CELL_WIDTH_PX, CELLS_AT_BORDER, CELLS_BESIDE, NOISE_TILE_PX,
    STRIP_WIDTH_PX,
};

/// Columns of cells in a strip.
const STRIP_CELLS: usize = STRIP_WIDTH_PX / CELL_WIDTH_PX;
/// Columns of cells compared side by side.
const LANES: usize = 32;

/// Columns of the image that share cells, and the rows in which they may hold lines.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Strip {
    /// First column.
    pub u0: usize,
    /// One past the last column.
    pub u1: usize,
    /// Disjoint row ranges, in order.
    pub rows: Vec<std::ops::Range<usize>>,
}

/// Sums of cells side by side.
type Sums<T> = [<T as Level>::Sum; LANES];

/// Finds bright cells; its memory is reused from image to image.
#[derive(Default)]
pub struct Cells<T: Level> {
    /// Cells in a row.
    across: usize,
    /// Rows of cells.
    down: usize,
    /// Groups of [`LANES`] cells in a row.
    groups: usize,
    /// Sums of grey levels, row by row of cells. Where the image is not a whole number of cells wide or high, the last
    /// cells overlap their predecessors.
    sums: Vec<Sums<T>>,
    /// Minima of one group of columns: see [`Cells::find_least`].
    least: Vec<Sums<T>>,
}

impl<T: Level> Cells<T> {
    /// The strips of an image summed up before, with the rows in which lines may be.
    #[inline(always)]
    pub fn strips_with_light(&mut self, view: &View<T>, noise: &NoiseMap, strips: &mut Vec<Strip>) {
        strips.resize_with(self.across.div_ceil(STRIP_CELLS), Strip::default);
        for (strip, u0) in strips.iter_mut().zip((0..).step_by(STRIP_WIDTH_PX)) {
            (strip.u0, strip.u1) = (u0, (u0 + STRIP_WIDTH_PX).min(view.width));
            strip.rows.clear();
        }
        for (group, strips) in strips.chunks_mut(LANES / STRIP_CELLS).enumerate() {
            self.mark_bright(group, noise, strips, view.height);
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
            let n_whole = view.width / CELL_WIDTH_PX;
            T::cell_sums(rows.map(|row| row.as_chunks().0), &mut out[..n_whole]);
            if !view.width.is_multiple_of(CELL_WIDTH_PX) {
                let tails = rows.map(|r| r.last_chunk::<CELL_WIDTH_PX>().expect("rows are wider than cells"));
                out[across - 1] = T::cell_sum(tails);
            }
        }
    }

    /// Marks the strips of a group of columns where a cell exceeds, by [`CELL_MIN_SNR`], both the darkest cell above
    /// and the darkest cell below it.
    #[inline(always)]
    fn mark_bright(&mut self, group: usize, noise: &NoiseMap, strips: &mut [Strip], height: usize) {
        self.find_least(group);
        let scale = CELL_MIN_SNR * ((CELL_WIDTH_PX * CELL_HEIGHT_PX) as f32).sqrt();
        let n = LANES.min(self.across - group * LANES);
        // One bit for every strip that was lit in the row before.
        let mut before = 0;
        // Lanes beyond the last column are never bright.
        let mut thresholds = [T::Sum::MAX; LANES];
        let levels = self.sums[group..].iter().step_by(self.groups);
        let rows = levels.zip(&self.least).zip(&self.least[CELLS_BESIDE + 1..]);
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
            let mut bright = 0u32;
            for lane in 0..LANES {
                let base = above[lane].max(below[lane]);
                bright |= u32::from(here[lane].minus(base) >= thresholds[lane]) << lane;
            }
            let lit = of_strips(bright);
            let mut changed = lit ^ before;
            before = lit;
            while changed != 0 {
                let lane = changed.trailing_zeros();
                changed &= changed - 1;
                let strip = &mut strips[lane as usize / STRIP_CELLS];
                if lit >> lane & 1 != 0 { strip.begin(row) } else { strip.end(row, height) }
            }
        }
        while before != 0 {
            strips[before.trailing_zeros() as usize / STRIP_CELLS].end(self.down, height);
            before &= before - 1;
        }
    }

    /// For a group of columns, the minimum of the [`CELLS_BESIDE`] rows of cells before every row, and before as many
    /// rows beyond the last; rows outside the image are ignored. Each window is the end of one run of that many rows
    /// and the beginning of the next, and both minima are updated row by row (van Herk 1992).
    #[inline(always)]
    fn find_least(&mut self, group: usize) {
        let beyond = [T::Sum::MAX; LANES];
        let mut to_end = [beyond; CELLS_BESIDE];
        self.least.clear();
        let mut rows = self.sums[group..].iter().step_by(self.groups);
        while self.least.len() < self.down + CELLS_BESIDE + 1 {
            let mut run = [beyond; CELLS_BESIDE];
            run.iter_mut().zip(&mut rows).for_each(|(own, row)| *own = *row);
            let mut from_begin = beyond;
            for (row, to_end) in run.iter().zip(&to_end) {
                self.least.push(lower::<T>(&from_begin, to_end));
                from_begin = lower::<T>(&from_begin, row);
            }
            let mut least = beyond;
            for (row, to_end) in run.iter().zip(&mut to_end).rev() {
                least = lower::<T>(&least, row);
                *to_end = least;
            }
        }
    }
}

/// The smaller of each pair.
#[inline(always)]
fn lower<T: Level>(a: &Sums<T>, b: &Sums<T>) -> Sums<T> {
    let mut lower = *a;
    for lane in 0..LANES {
        lower[lane] = lower[lane].min(b[lane]);
    }
    lower
}

/// Converts one bit per cell to one bit per strip, at the strip's first cell.
#[inline(always)]
fn of_strips(bright: u32) -> u32 {
    let mut lit = 0;
    let mut firsts = 0;
    for lane in 0..LANES {
        lit |= bright >> (lane % STRIP_CELLS);
        firsts |= u32::from(lane % STRIP_CELLS == 0) << lane;
    }
    lit & firsts
}

impl Strip {
    /// Starts a lit range at a row of cells: lines may begin slightly above it.
    #[inline(always)]
    fn begin(&mut self, row: usize) {
        let from = (row * CELL_HEIGHT_PX).saturating_sub(CELL_MARGIN_PX);
        if self.rows.last().is_none_or(|last| last.end < from) {
            self.rows.push(from..from);
        }
    }

    /// Ends a lit range before a row of cells: lines may extend slightly below it.
    #[inline(always)]
    fn end(&mut self, row: usize, height: usize) {
        if let Some(last) = self.rows.last_mut() {
            last.end = (row * CELL_HEIGHT_PX + CELL_MARGIN_PX).min(height);
        }
    }
}
