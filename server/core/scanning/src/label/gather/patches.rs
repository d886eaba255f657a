//! A grid over the view for neighbourhood searches.

use nalgebra::Vector2;
use rayon::prelude::*;

/// Most cells per entry: bounds the memory if a few entries are far from the others.
const MAX_CELLS_PER_ENTRY: usize = 64;

/// A point as viewed from one position: coordinates across the view at the reference depth, and depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewPoint {
    /// (x, y) at the reference depth.
    pub xy_mm: Vector2<f64>,
    /// z.
    pub depth_mm: f64,
}

/// Entries sorted into cells the size of the search radii, aligned with the travel.
#[derive(Debug, Clone)]
pub struct PatchGrid {
    travel: Vector2<f64>,
    radii_mm: [f64; 2],
    /// Smallest coordinates of the entries, in radii.
    origin: Vector2<f64>,
    n_cells: [usize; 2],
    /// First entry of each cell in `entries`; one more than cells.
    starts: Vec<u32>,
    entries: Vec<u32>,
    /// Coordinates of each of `entries` across and along the travel, in radii.
    places: Vec<Vector2<f64>>,
}

impl PatchGrid {
    /// A grid over places of the view. `radii_mm`: search radius across and along `travel`.
    pub fn new(
        xy_mm: impl IndexedParallelIterator<Item = Vector2<f64>>,
        travel: Vector2<f64>,
        radii_mm: [f64; 2],
    ) -> Self {
        let mut grid = Self {
            travel: travel.normalize(),
            radii_mm,
            origin: Vector2::zeros(),
            n_cells: [0, 0],
            starts: vec![0],
            entries: Vec::new(),
            places: Vec::new(),
        };
        grid.places = xy_mm.map(|xy_mm| grid.in_radii(&xy_mm)).collect();
        if grid.places.is_empty() {
            return grid;
        }
        let low = grid.places.iter().fold(Vector2::repeat(f64::INFINITY), |low, place| low.inf(place));
        let high = grid.places.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |high, place| high.sup(place));
        let most = (grid.places.len() * MAX_CELLS_PER_ENTRY) as f64;
        grid.origin = low;
        grid.n_cells = [0, 1].map(|axis| ((high - low)[axis].floor() + 1.0).min(most) as usize);
        grid.fill();
        grid
    }

    /// A vector across the view: its coordinates across and along the travel, in radii.
    fn in_radii(&self, xy_mm: &Vector2<f64>) -> Vector2<f64> {
        let across_mm = xy_mm.x * self.travel.y - xy_mm.y * self.travel.x;
        Vector2::new(across_mm / self.radii_mm[0], xy_mm.dot(&self.travel) / self.radii_mm[1])
    }

    fn fill(&mut self) {
        let cells: Vec<usize> = self.places.par_iter().map(|place| self.cell(place)).collect();
        let mut starts = vec![0u32; self.n_cells[0] * self.n_cells[1] + 1];
        for &cell in &cells {
            starts[cell + 1] += 1;
        }
        for idx in 1..starts.len() {
            starts[idx] += starts[idx - 1];
        }
        let mut next = starts.clone();
        self.entries = vec![0; cells.len()];
        for (idx, &cell) in cells.iter().enumerate() {
            self.entries[next[cell] as usize] = idx as u32;
            next[cell] += 1;
        }
        self.starts = starts;
        self.places = self.entries.par_iter().map(|&entry| self.places[entry as usize]).collect();
    }

    fn cell_along(&self, place: &Vector2<f64>, axis: usize) -> isize {
        (place[axis] - self.origin[axis]).floor() as isize
    }

    fn cell(&self, place: &Vector2<f64>) -> usize {
        let [column, row] = [0, 1]
            .map(|axis| (self.cell_along(place, axis).max(0) as usize).min(self.n_cells[axis].saturating_sub(1)));
        row * self.n_cells[0] + column
    }

    /// Whether an offset across the view lies within the search ellipse.
    pub fn within(&self, offset_mm: &Vector2<f64>) -> bool {
        self.in_radii(offset_mm).norm_squared() <= 1.0
    }

    /// Calls `visit(entry, squared distance in radii)` for every entry within the search ellipse.
    pub fn for_each_near(&self, xy_mm: &Vector2<f64>, mut visit: impl FnMut(usize, f64)) {
        if self.places.is_empty() {
            return;
        }
        let place = self.in_radii(xy_mm);
        let [columns, rows] = [0, 1].map(|axis| {
            let middle = self.cell_along(&place, axis);
            middle.saturating_sub(1).max(0)..middle.saturating_add(2).min(self.n_cells[axis] as isize)
        });
        if columns.is_empty() {
            return;
        }
        for row in rows {
            // The cells of a row follow one another.
            let [from, to] = [columns.start, columns.end]
                .map(|column| self.starts[row as usize * self.n_cells[0] + column as usize] as usize);
            let of_row = from..to;
            for (entry, there) in self.entries[of_row.clone()].iter().zip(&self.places[of_row]) {
                let distance = (place - there).norm_squared();
                if distance <= 1.0 {
                    visit(*entry as usize, distance);
                }
            }
        }
    }
}
