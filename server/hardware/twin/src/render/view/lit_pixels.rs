//! Set of the pixels that light can reach: a bit per pixel, so that the rest of an image costs nothing.

use crate::arithmetic::{ceil, floor};
use crate::params::PSF_RADIUS_PX;

/// Pixels per word of a row.
pub(crate) const WORD_PX: usize = 64;

/// Indices of the set bits, from the lowest.
#[inline]
pub(crate) fn lanes(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < WORD_PX).then_some(lane)
    })
}

/// Bits of the columns from `left` to `right` in a word of a row that contains any of them.
#[inline(always)]
pub(crate) fn bits_between(left: usize, right: usize, word: usize) -> u64 {
    let from = left.max(word * WORD_PX) - word * WORD_PX;
    let to = right.min(word * WORD_PX + WORD_PX - 1) - word * WORD_PX;
    (u64::MAX << from) & (u64::MAX >> (WORD_PX - 1 - to))
}

/// A set of pixels of an image.
#[derive(Debug, Clone)]
pub(crate) struct LitPixels {
    width: usize,
    height: usize,
    words_per_row: usize,
    words: Vec<u64>,
}

impl LitPixels {
    pub(crate) fn none(width: usize, height: usize) -> Self {
        let words_per_row = width.div_ceil(WORD_PX);
        Self { width, height, words_per_row, words: vec![0; words_per_row * height] }
    }

    /// Empties the set.
    pub(crate) fn clear(&mut self) {
        self.words.fill(0);
    }

    /// Adds the pixels of the rectangle between two corners (u, v), widened by `margin_px` and cropped to the image.
    pub(crate) fn add_rectangle(&mut self, a: [f64; 2], b: [f64; 2], margin_px: f64) {
        let span = |axis: usize, size: usize| {
            let low = floor(a[axis].min(b[axis]) - margin_px).max(0.0);
            let high = ceil(a[axis].max(b[axis]) + margin_px).min(size as f64 - 1.0);
            (low <= high).then_some((low as usize, high as usize))
        };
        let (Some((left, right)), Some((top, bottom))) = (span(0, self.width), span(1, self.height)) else {
            return;
        };
        for word in left / WORD_PX..=right / WORD_PX {
            let bits = bits_between(left, right, word);
            let rows = &mut self.words[top * self.words_per_row..(bottom + 1) * self.words_per_row];
            rows.chunks_exact_mut(self.words_per_row).for_each(|row| row[word] |= bits);
        }
    }

    /// Adds pixels of a segment that begins at column `u` of row `v` and lies in one word: bit 0 is that column.
    pub(crate) fn add_bits(&mut self, u: usize, v: usize, bits: u64) {
        self.words[v * self.words_per_row + u / WORD_PX] |= bits << (u % WORD_PX);
    }

    /// Segments (u, v, n) of rows that contain the set, row by row: whole steps of `step_px`, which divides a word, at
    /// most a word each. The last step may extend beyond the image.
    pub(crate) fn segments(&self, step_px: usize) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
        let lit = self.words.iter().enumerate().filter(|(_, word)| **word != 0);
        lit.map(move |(idx, &word)| {
            let (u, v) = (idx % self.words_per_row * WORD_PX, idx / self.words_per_row);
            let first = word.trailing_zeros() as usize / step_px * step_px;
            let end = (WORD_PX - word.leading_zeros() as usize).next_multiple_of(step_px);
            (u + first, v, end - first)
        })
    }

    /// Whether the set contains any pixel of these columns and rows of the image, first and last.
    pub(crate) fn any_between(&self, (left, right): (usize, usize), (top, bottom): (usize, usize)) -> bool {
        (left / WORD_PX..=right / WORD_PX).any(|word| {
            let bits = bits_between(left, right, word);
            let rows = self.words[top * self.words_per_row + word..].iter().step_by(self.words_per_row);
            rows.take(bottom + 1 - top).any(|row| row & bits != 0)
        })
    }

    /// The pixels of the word that contains pixel (u, v): bit 0 is its first.
    pub(crate) fn word(&self, u: usize, v: usize) -> u64 {
        self.words[v * self.words_per_row + u / WORD_PX]
    }

    /// Words in a row.
    pub(crate) fn words_per_row(&self) -> usize {
        self.words_per_row
    }

    /// Words in the image.
    pub(crate) fn n_words(&self) -> usize {
        self.words.len()
    }

    /// Adds to `runs` the runs of pixels (from, to) of row `v` that lens blur may reach from the set, in whole words;
    /// `rows` is scratch.
    pub(crate) fn blurred_runs(&self, v: usize, rows: &mut Vec<u64>, runs: &mut Vec<(usize, usize)>) {
        let top = v.saturating_sub(PSF_RADIUS_PX);
        let bottom = (v + PSF_RADIUS_PX).min(self.height - 1);
        rows.clear();
        rows.resize(self.words_per_row, 0);
        let around = &self.words[top * self.words_per_row..(bottom + 1) * self.words_per_row];
        for row in around.chunks_exact(self.words_per_row) {
            rows.iter_mut().zip(row).for_each(|(all, word)| *all |= word);
        }
        for word in 0..self.words_per_row {
            let before = if word > 0 { rows[word - 1] >> (WORD_PX - PSF_RADIUS_PX) } else { 0 };
            let after = rows.get(word + 1).map_or(0, |bits| bits << (WORD_PX - PSF_RADIUS_PX));
            if before | rows[word] | after == 0 {
                continue;
            }
            let (from, to) = (word * WORD_PX, (word * WORD_PX + WORD_PX).min(self.width));
            match runs.last_mut() {
                Some(last) if last.1 == from => last.1 = to,
                _ => runs.push((from, to)),
            }
        }
    }
}

/// Column-wise running counts of the cells that contain pixels of a set, for fast queries of many rectangles.
#[derive(Debug, Default)]
pub(crate) struct FilledCells {
    above: Vec<u16>,
}

impl FilledCells {
    /// Columns and rows of a cell.
    const SIDES_PX: [usize; 2] = [16, 8];

    /// Cells in a word.
    const PER_WORD: usize = WORD_PX / Self::SIDES_PX[0];

    /// Recomputes the counts for a set.
    pub(crate) fn count(&mut self, lit: &LitPixels) {
        let per_row = lit.words_per_row * Self::PER_WORD;
        self.above.clear();
        self.above.resize(per_row, 0);
        let mut rows = vec![0; lit.words_per_row];
        for block in lit.words.chunks(lit.words_per_row * Self::SIDES_PX[1]) {
            rows.fill(0);
            for row in block.chunks_exact(lit.words_per_row) {
                rows.iter_mut().zip(row).for_each(|(all, word)| *all |= word);
            }
            for word in &rows {
                for part in 0..Self::PER_WORD {
                    let filled = (word >> (part * Self::SIDES_PX[0])) as u16 != 0;
                    self.above.push(self.above[self.above.len() - per_row] + u16::from(filled));
                }
            }
        }
    }

    /// Whether the cells touched by a rectangle (two corners, lower first) contain any pixel of the counted set.
    pub(crate) fn any_within(&self, lit: &LitPixels, low: [f64; 2], high: [f64; 2]) -> bool {
        if high[0] < 0.0 || high[1] < 0.0 || low[0] >= lit.width as f64 || low[1] >= lit.height as f64 {
            return false;
        }
        let [columns, rows] = Self::SIDES_PX;
        let (left, right) = (low[0] as usize / columns, (high[0] as usize).min(lit.width - 1) / columns);
        let (top, below) = (low[1] as usize / rows, (high[1] as usize).min(lit.height - 1) / rows + 1);
        let row = |row: usize| &self.above[row * lit.words_per_row * Self::PER_WORD..][left..=right];
        row(top).iter().zip(row(below)).any(|(a, b)| a != b)
    }
}

#[cfg(test)]
impl LitPixels {
    /// Every pixel (u, v), row by row.
    pub(crate) fn pixels(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let all = (0..self.height).flat_map(|v| (0..self.width).map(move |u| (u, v)));
        all.filter(|(u, v)| self.words[v * self.words_per_row + u / WORD_PX] >> (u % WORD_PX) & 1 == 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_across_words_holds_exactly_its_pixels() {
        let mut lit = LitPixels::none(130, 5);
        lit.add_rectangle([62.0, 1.0], [128.0, 2.0], 0.0);
        let pixels: Vec<_> = lit.pixels().collect();
        let expected: Vec<_> = (1..=2).flat_map(|v| (62..=128).map(move |u| (u, v))).collect();
        assert_eq!(pixels, expected);
        assert_eq!(lit.segments(8).take(3).collect::<Vec<_>>(), [(56, 1, 8), (64, 1, 64), (128, 1, 8)]);
        let mut runs = Vec::new();
        lit.blurred_runs(4, &mut Vec::new(), &mut runs);
        assert_eq!(runs, [(0, 130)]);
    }

    #[test]
    fn lens_blur_reaches_four_pixels_from_the_set_and_no_farther() {
        let runs_around = |u: usize, v: usize| {
            let mut lit = LitPixels::none(200, 12);
            lit.add_bits(u / 8 * 8, 6, 1 << (u % 8));
            let mut runs = Vec::new();
            lit.blurred_runs(v, &mut Vec::new(), &mut runs);
            runs
        };
        assert_eq!(runs_around(68, 6), [(64, 128)]);
        assert_eq!(runs_around(67, 2), [(0, 128)]);
        assert_eq!(runs_around(124, 10), [(64, 192)]);
        assert_eq!(runs_around(199, 6), [(192, 200)]);
        assert_eq!(runs_around(68, 1), []);
        assert_eq!(runs_around(68, 11), []);
    }

    #[test]
    fn rectangles_are_cropped_to_the_image() {
        let mut lit = LitPixels::none(70, 3);
        lit.add_rectangle([-9.0, -9.0], [-5.0, 1.0], 1.0);
        lit.add_rectangle([69.5, 2.0], [90.0, 90.0], 1.0);
        assert_eq!(lit.pixels().collect::<Vec<_>>(), [(68, 1), (69, 1), (68, 2), (69, 2)]);
    }
}
