//! Where lines can be: cells of 8 × 4 pixels brighter than what lies above and below them.
//!
//! This is the only look at every pixel. A cell averages 32 pixels, so that a line at the limit of detection in one
//! column stands out clearly; the threshold is low, for a cell too many costs time only.

use crate::centreline::reference::noise::NoiseMap;
use crate::centreline::view::{Level, View};
use crate::params::{
    CELL_HEIGHT_PX, CELL_MIN_SNR, CELL_WIDTH_PX, CELLS_AT_BORDER, CELLS_BESIDE, NOISE_TILE_PX, STRIP_WIDTH_PX,
};

/// Columns of cells in a strip.
const STRIP_CELLS: usize = STRIP_WIDTH_PX / CELL_WIDTH_PX;
/// Columns of cells compared side by side.
const LANES: usize = 16;

/// Columns of the image that share cells, and the rows in which they may hold lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    /// First column.
    pub u0: usize,
    /// One past the last column.
    pub u1: usize,
    /// Rows, in order, apart from each other.
    pub rows: Vec<std::ops::Range<usize>>,
}

/// Sums of grey levels over cells, row by row of cells. Where the image does not hold a whole number of cells, the
/// last ones overlap those before.
struct Cells {
    across: usize,
    down: usize,
    sums: Vec<i32>,
}

impl Cells {
    #[inline(always)]
    fn of<T: Level>(view: &View<T>) -> Self {
        let (across, down) = (view.width.div_ceil(CELL_WIDTH_PX), view.height.div_ceil(CELL_HEIGHT_PX));
        let mut sums = vec![0i32; across * down];
        for (row, out) in sums.chunks_exact_mut(across).enumerate() {
            let v = (row * CELL_HEIGHT_PX).min(view.height - CELL_HEIGHT_PX);
            let rows: [&[T]; CELL_HEIGHT_PX] = std::array::from_fn(|i| view.row(v + i));
            let [a, b, c, d] = rows.map(|r| r.as_chunks::<CELL_WIDTH_PX>().0);
            for ((((out, a), b), c), d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                *out = T::cell_sum([a, b, c, d]);
            }
            if !view.width.is_multiple_of(CELL_WIDTH_PX) {
                let tails = rows.map(|r| {
                    r.last_chunk::<CELL_WIDTH_PX>().map_or(0, |t| t.iter().map(|l| l.int()).sum::<i32>())
                });
                out[across - 1] = tails.iter().sum();
            }
        }
        Self { across, down, sums }
    }
}

/// The strips of an image with the rows in which lines may be.
#[inline(always)]
pub fn strips_with_light<T: Level>(view: &View<T>, noise: &NoiseMap) -> Vec<Strip> {
    let cells = Cells::of(view);
    let words = cells.down.div_ceil(64);
    let mut bright = vec![0u64; cells.across * words];
    for first in (0..cells.across).step_by(LANES) {
        mark_bright(&cells, first, noise, &mut bright[first * words..], words);
    }
    let of_cells = |idx: usize| &bright[idx * words..(idx + 1) * words];
    (0..cells.across)
        .step_by(STRIP_CELLS)
        .map(|first| {
            let near = first.saturating_sub(1)..(first + STRIP_CELLS + 1).min(cells.across);
            let bits = |word: usize| near.clone().fold(0, |bits, idx| bits | of_cells(idx)[word]);
            let u0 = first * CELL_WIDTH_PX;
            let rows = rows_of((0..words).map(bits), cells.down, view.height);
            Strip { u0, u1: (u0 + STRIP_WIDTH_PX).min(view.width), rows }
        })
        .collect()
}

/// Runs of set bits, one cell longer at either end, as rows of pixels.
#[inline(always)]
fn rows_of(bits: impl Iterator<Item = u64>, n_cells: usize, height: usize) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
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
    runs
}

/// Sets a bit for every cell of some neighbouring strips that is brighter, by [`CELL_MIN_SNR`], than the darkest cell
/// above and the darkest below it.
#[inline(always)]
fn mark_bright(cells: &Cells, first: usize, noise: &NoiseMap, bright: &mut [u64], words: usize) {
    let n = LANES.min(cells.across - first);
    // Rows of cells with as many beyond either end as a comparison looks at.
    let padded = cells.down + 2 * CELLS_BESIDE;
    let mut levels = vec![[i32::MAX; LANES]; padded];
    for (row, out) in levels[CELLS_BESIDE..].iter_mut().take(cells.down).enumerate() {
        out[..n].copy_from_slice(&cells.sums[row * cells.across + first..][..n]);
    }
    let least = running_least(&levels);
    let scale = CELL_MIN_SNR * ((CELL_WIDTH_PX * CELL_HEIGHT_PX) as f32).sqrt();
    let mut thresholds = [0i32; LANES];
    let mut word = [0u64; LANES];
    for row in 0..cells.down {
        if (row * CELL_HEIGHT_PX).is_multiple_of(NOISE_TILE_PX) {
            let sigmas = noise.row(row * CELL_HEIGHT_PX);
            for (lane, threshold) in thresholds.iter_mut().enumerate().take(n) {
                *threshold = (scale * sigmas[(first + lane) * CELL_WIDTH_PX / NOISE_TILE_PX]) as i32;
            }
        }
        let (here, above, below) = (&levels[row + CELLS_BESIDE], &least[row], &least[row + CELLS_BESIDE + 1]);
        let (alone_above, alone_below) = (row + CELLS_AT_BORDER >= cells.down, row < CELLS_AT_BORDER);
        for lane in 0..LANES {
            let base = match (alone_above, alone_below) {
                (true, false) => above[lane],
                (false, true) => below[lane],
                _ => above[lane].max(below[lane]),
            };
            word[lane] |= u64::from(here[lane].saturating_sub(base) > thresholds[lane]) << (row % 64);
        }
        if row % 64 == 63 || row + 1 == cells.down {
            word.iter().take(n).enumerate().for_each(|(lane, &w)| bright[lane * words + row / 64] = w);
            word = [0; LANES];
        }
    }
}

/// For every row of cells the least of it and the `CELLS_BESIDE − 1` that follow.
#[inline(always)]
fn running_least(levels: &[[i32; LANES]]) -> Vec<[i32; LANES]> {
    let mut least = levels.to_vec();
    let mut covered = 1;
    while covered < CELLS_BESIDE {
        let step = covered.min(CELLS_BESIDE - covered);
        for row in 0..least.len() - step {
            let further = least[row + step];
            for lane in 0..LANES {
                least[row][lane] = least[row][lane].min(further[lane]);
            }
        }
        covered += step;
    }
    least
}
