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
        let inside =
            (0..LANES).all(|i| v[i] >= reach && (v[i] + reach) * view.width + u[i] + LANES <= view.pixels.len());
        let neighbours = (1..LANES).all(|i| u[i] == u[0] + i);
        if inside && neighbours {
            self.copy_runs(view, places);
        } else {
            self.copy_each(view, places);
        }
    }

    /// Columns in a row about the same row are copied together, and what follows them is overwritten by the next.
    #[inline(always)]
    fn copy_runs(&mut self, view: &View<T>, Places { u, v }: &Places) {
        let top = v.iter().copied().min().unwrap_or(0) - self.reach;
        let mut runs = [(0, 0); LANES];
        let mut n_runs = 0;
        for i in 0..LANES {
            if i == 0 || v[i] != v[i - 1] {
                runs[n_runs] = ((v[i] - self.reach - top) * view.width + u[i], i);
                n_runs += 1;
            }
        }
        for (k, row) in self.rows.iter_mut().enumerate() {
            let from = &view.pixels[(top + k) * view.width..];
            for &(start, lane) in &runs[..n_runs] {
                let lane = lane % LANES;
                row[lane..lane + LANES].copy_from_slice(&from[start..start + LANES]);
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

    /// Rows `middle − half ..= middle + half`, counted from the places.
    #[inline(always)]
    pub fn rows(&self, middle: isize, half: usize) -> impl Iterator<Item = &[T; LANES]> {
        let middle = self.reach.wrapping_add_signed(middle);
        let rows = &self.rows[middle - half..=middle + half];
        rows.iter().map(|row| row.first_chunk().expect("a row holds twice as many"))
    }
}
