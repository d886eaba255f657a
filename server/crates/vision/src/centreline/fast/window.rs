//! Parts of columns laid side by side, each about its own row.

use crate::centreline::view::{Level, View};

/// Columns measured side by side.
pub const LANES: usize = 16;

/// Where columns are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Places {
    /// Columns.
    pub u: [usize; LANES],
    /// Rows.
    pub v: [usize; LANES],
}

/// The pixels about some places, row by row.
#[derive(Default)]
pub struct Window<T> {
    /// Every row has room for a copy that begins at its last lane.
    rows: Vec<[T; 2 * LANES]>,
    reach: usize,
}

impl<T: Level> Window<T> {
    /// Fills the window with the pixels of every place from `reach` rows above to `reach` below it. Beyond the image
    /// its border is repeated.
    #[inline(always)]
    pub fn straighten(&mut self, view: &View<T>, places: &Places, reach: usize) {
        self.reach = reach;
        self.rows.resize(2 * reach + 1, [T::default(); 2 * LANES]);
        let Places { u, v } = places;
        let mut inside = true;
        for i in 0..LANES {
            inside &= (v[i] >= reach) & (v[i] + reach < view.height) & (u[i] == u[0] + i);
        }
        if inside && u[0] + 2 * LANES <= view.width {
            self.copy_runs(view, places);
        } else if inside {
            self.copy_runs_at_border(view, places);
        } else {
            self.copy_each(view, places);
        }
    }

    /// Columns in a row about the same row are copied together, and what follows them is overwritten by the next.
    #[inline(always)]
    fn copy_runs(&mut self, view: &View<T>, Places { u, v }: &Places) {
        for i in 0..LANES {
            if i > 0 && v[i] == v[i - 1] {
                continue;
            }
            let columns = u[i]..u[i] + LANES;
            let first = (v[i] - self.reach) * view.width;
            let rows = view.pixels[first..].chunks_exact(view.width);
            for (row, levels) in self.rows.iter_mut().zip(rows) {
                row[i..i + LANES].copy_from_slice(&levels[columns.clone()]);
            }
        }
    }

    /// The same where the image ends within the columns that are copied; what lies beyond is left as it was.
    fn copy_runs_at_border(&mut self, view: &View<T>, Places { u, v }: &Places) {
        for i in (0..LANES).filter(|&i| u[i] < view.width && (i == 0 || v[i] != v[i - 1])) {
            let columns = u[i]..(u[i] + LANES).min(view.width);
            let first = (v[i] - self.reach) * view.width;
            let rows = view.pixels[first..].chunks_exact(view.width);
            for (row, levels) in self.rows.iter_mut().zip(rows) {
                row[i..i + columns.len()].copy_from_slice(&levels[columns.clone()]);
            }
        }
    }

    #[inline(always)]
    fn copy_each(&mut self, view: &View<T>, Places { u, v }: &Places) {
        for (k, row) in self.rows.iter_mut().enumerate() {
            for i in 0..LANES {
                let v = (v[i] + k).saturating_sub(self.reach).min(view.height - 1);
                row[i] = view.pixels[v * view.width + u[i].min(view.width - 1)];
            }
        }
    }

    /// The rows at `offset` from the places, `offset` at most the reach.
    #[inline(always)]
    pub fn row(&self, offset: isize) -> &[T; LANES] {
        let row = &self.rows[self.reach.wrapping_add_signed(offset)];
        row.first_chunk().expect("a row holds twice as many")
    }

    /// The rows above and below the places at the same distance, the nearest first.
    #[inline(always)]
    pub fn pairs(&self) -> impl Iterator<Item = (&[T; LANES], &[T; LANES])> {
        let (above, below) = self.rows.split_at(self.reach);
        above.iter().rev().zip(&below[1..]).map(|(above, below)| {
            let halves = [above, below].map(|row| row.first_chunk().expect("a row holds twice as many"));
            (halves[0], halves[1])
        })
    }

    /// Rows `middle − half ..= middle + half`, counted from the places.
    #[inline(always)]
    pub fn rows(&self, middle: isize, half: usize) -> impl Iterator<Item = &[T; LANES]> {
        let middle = self.reach.wrapping_add_signed(middle);
        let rows = &self.rows[middle - half..=middle + half];
        rows.iter().map(|row| row.first_chunk().expect("a row holds twice as many"))
    }
}
