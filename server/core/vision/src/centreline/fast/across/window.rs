//! Parts of columns side by side, each centred on its own row.

use crate::centreline::view::{Level, View};

/// Columns measured side by side.
pub const LANES: usize = 16;

/// Columns and rows of the windows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Places {
    /// Columns.
    pub u: [u32; LANES],
    /// Rows.
    pub v: [u32; LANES],
    /// Whether the columns are neighbours.
    pub adjoin: bool,
}

/// Number of neighbouring columns that may share one row.
pub const SHARING: usize = 4;

impl Places {
    /// Whether each group of [`SHARING`] columns shares a row.
    #[inline(always)]
    fn share_rows(&self) -> bool {
        let (groups, _) = self.v.as_chunks::<SHARING>();
        groups.iter().fold(true, |all, group| {
            all & (group[0] == group[1]) & (group[1] == group[2]) & (group[2] == group[3])
        })
    }

    /// Whether `reach` rows above and below every place lie inside an image of this height.
    #[inline(always)]
    fn are_inside(&self, reach: usize, height: usize) -> bool {
        let (mut first, mut last) = (u32::MAX, 0);
        for v in self.v {
            (first, last) = (first.min(v), last.max(v));
        }
        first as usize >= reach && last as usize + reach < height
    }
}

/// The pixels around some places, row by row.
#[derive(Default)]
pub struct Window<T> {
    /// Every row has room for a copy that starts at its last lane.
    rows: Vec<[T; 2 * LANES]>,
    reach: usize,
}

impl<T: Level> Window<T> {
    /// Copies the pixels from `reach` rows above to `reach` rows below every place. Beyond the image its border is
    /// repeated.
    #[inline(always)]
    pub fn straighten(&mut self, view: &View<T>, places: &Places, reach: usize) {
        self.reach = reach;
        self.rows.resize(2 * reach + 1, [T::default(); 2 * LANES]);
        let u0 = places.u[0] as usize;
        if !places.adjoin || !places.are_inside(reach, view.height) {
            self.copy_each(view, places);
        } else if places.share_rows() && u0 + LANES <= view.width {
            self.copy_shared(view, u0, &places.v);
        } else if u0 + 2 * LANES <= view.width {
            self.copy_runs(view, u0, &places.v);
        } else {
            self.copy_runs_at_border(view, u0, &places.v);
        }
    }

    /// The rows of an image, starting `reach` rows above row `v`.
    #[inline(always)]
    fn rows_of<'a>(&self, view: &View<'a, T>, v: u32) -> std::slice::ChunksExact<'a, T> {
        view.pixels[(v as usize - self.reach) * view.width..].chunks_exact(view.width)
    }

    /// For columns of which each group of [`SHARING`] shares a row: no branch depends on the slope of the line.
    #[inline(always)]
    fn copy_shared(&mut self, view: &View<T>, u0: usize, v: &[u32; LANES]) {
        let (a, b) = (self.rows_of(view, v[0]), self.rows_of(view, v[SHARING]));
        let (c, d) = (self.rows_of(view, v[2 * SHARING]), self.rows_of(view, v[3 * SHARING]));
        let levels = &mut self.rows;
        for (row, (((a, b), c), d)) in levels.iter_mut().zip(a.zip(b).zip(c).zip(d)) {
            row[..SHARING].copy_from_slice(&a[u0..u0 + SHARING]);
            row[SHARING..2 * SHARING].copy_from_slice(&b[u0 + SHARING..u0 + 2 * SHARING]);
            row[2 * SHARING..3 * SHARING].copy_from_slice(&c[u0 + 2 * SHARING..u0 + 3 * SHARING]);
            row[3 * SHARING..4 * SHARING].copy_from_slice(&d[u0 + 3 * SHARING..u0 + 4 * SHARING]);
        }
    }

    /// Consecutive columns with the same row are copied together; the next copy overwrites the excess.
    #[inline(always)]
    fn copy_runs(&mut self, view: &View<T>, u0: usize, v: &[u32; LANES]) {
        for i in 0..LANES {
            if i > 0 && v[i] == v[i - 1] {
                continue;
            }
            let columns = u0 + i..u0 + i + LANES;
            let rows = self.rows_of(view, v[i]);
            for (row, levels) in self.rows.iter_mut().zip(rows) {
                row[i..i + LANES].copy_from_slice(&levels[columns.clone()]);
            }
        }
    }

    /// Variant for columns at the image border; lanes beyond the border keep their old content.
    fn copy_runs_at_border(&mut self, view: &View<T>, u0: usize, v: &[u32; LANES]) {
        for i in (0..LANES).filter(|&i| u0 + i < view.width && (i == 0 || v[i] != v[i - 1])) {
            let columns = u0 + i..(u0 + i + LANES).min(view.width);
            let rows = self.rows_of(view, v[i]);
            for (row, levels) in self.rows.iter_mut().zip(rows) {
                row[i..i + columns.len()].copy_from_slice(&levels[columns.clone()]);
            }
        }
    }

    #[inline(always)]
    fn copy_each(&mut self, view: &View<T>, Places { u, v, .. }: &Places) {
        let inside = |v: u32| v as usize >= self.reach && v as usize + self.reach < view.height;
        for i in 0..LANES {
            let u = (u[i] as usize).min(view.width - 1);
            if inside(v[i]) {
                let rows = self.rows_of(view, v[i]);
                self.rows.iter_mut().zip(rows).for_each(|(row, levels)| row[i] = levels[u]);
                continue;
            }
            for (k, row) in self.rows.iter_mut().enumerate() {
                let v = (v[i] as usize + k).saturating_sub(self.reach).min(view.height - 1);
                row[i] = view.pixels[v * view.width + u];
            }
        }
    }

    /// The rows at `offset` from the places; |`offset`| is at most the reach.
    #[inline(always)]
    pub fn row(&self, offset: isize) -> &[T; LANES] {
        let row = &self.rows[self.reach.wrapping_add_signed(offset)];
        first_half(row)
    }

    /// Pairs of rows at equal distance above and below the places, the nearest first.
    #[inline(always)]
    pub fn pairs(&self) -> impl Iterator<Item = (&[T; LANES], &[T; LANES])> {
        let (above, below) = self.rows.split_at(self.reach);
        above.iter().rev().zip(&below[1..]).map(|(above, below)| (first_half(above), first_half(below)))
    }

    /// Rows `middle − half ..= middle + half`, counted from the places.
    #[inline(always)]
    pub fn rows(&self, middle: isize, half: usize) -> impl Iterator<Item = &[T; LANES]> {
        let middle = self.reach.wrapping_add_signed(middle);
        let rows = &self.rows[middle - half..=middle + half];
        rows.iter().map(first_half)
    }
}

#[inline(always)]
fn first_half<T>(row: &[T; 2 * LANES]) -> &[T; LANES] {
    row.first_chunk().expect("a row holds twice as many")
}
