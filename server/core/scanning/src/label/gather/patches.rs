//! A grid over the view for neighbourhood searches.

use nalgebra::Vector2;

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
    origin: Vector2<f64>,
    n_cells: [usize; 2],
    /// First entry of each cell in `entries`; one more than cells.
    starts: Vec<u32>,
    entries: Vec<u32>,
    places: Vec<Vector2<f64>>,
}

impl PatchGrid {
    /// A grid over `places`. `radii_mm`: search radius across and along `travel`.
    pub fn new(places: impl Iterator<Item = Vector2<f64>>, travel: Vector2<f64>, radii_mm: [f64; 2]) -> Self {
        let travel = travel.normalize();
        let turned = |xy: Vector2<f64>| Vector2::new(xy.x * travel.y - xy.y * travel.x, xy.dot(&travel));
        let places: Vec<Vector2<f64>> = places.map(turned).collect();
        let low = places.iter().fold(Vector2::repeat(f64::INFINITY), |low, place| low.inf(place));
        let high = places.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |high, place| high.sup(place));
        let mut grid =
            Self { travel, radii_mm, origin: low, n_cells: [0, 0], starts: vec![0], entries: Vec::new(), places };
        if grid.places.is_empty() {
            return grid;
        }
        let most = (grid.places.len() * MAX_CELLS_PER_ENTRY) as f64;
        let extent = high - low;
        let cells = [(extent.x / radii_mm[0]).floor() + 1.0, (extent.y / radii_mm[1]).floor() + 1.0];
        grid.n_cells = cells.map(|n| n.min(most) as usize);
        grid.fill();
        grid
    }

    fn fill(&mut self) {
        let cells: Vec<usize> = self.places.iter().map(|place| self.cell(place)).collect();
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
    }

    fn cell_along(&self, value: f64, axis: usize) -> isize {
        ((value - self.origin[axis]) / self.radii_mm[axis]).floor() as isize
    }

    fn cell(&self, place: &Vector2<f64>) -> usize {
        let [column, row] = [0, 1].map(|axis| {
            (self.cell_along(place[axis], axis).max(0) as usize).min(self.n_cells[axis].saturating_sub(1))
        });
        row * self.n_cells[0] + column
    }

    /// Whether an offset across the view lies within the search ellipse.
    pub fn within(&self, offset_mm: &Vector2<f64>) -> bool {
        let across = offset_mm.x * self.travel.y - offset_mm.y * self.travel.x;
        let along = offset_mm.dot(&self.travel);
        (across / self.radii_mm[0]).powi(2) + (along / self.radii_mm[1]).powi(2) <= 1.0
    }

    /// Calls `visit(entry, squared distance in radii)` for every entry within the search ellipse.
    pub fn for_each_near(&self, xy_mm: &Vector2<f64>, mut visit: impl FnMut(usize, f64)) {
        if self.places.is_empty() {
            return;
        }
        let place = Vector2::new(xy_mm.x * self.travel.y - xy_mm.y * self.travel.x, xy_mm.dot(&self.travel));
        let [columns, rows] = [0, 1].map(|axis| {
            let middle = self.cell_along(place[axis], axis);
            middle.saturating_sub(1).max(0)..middle.saturating_add(2).min(self.n_cells[axis] as isize)
        });
        for row in rows {
            for column in columns.clone() {
                let cell = row as usize * self.n_cells[0] + column as usize;
                for &entry in &self.entries[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
                    let offset = place - self.places[entry as usize];
                    let distance = (offset.x / self.radii_mm[0]).powi(2) + (offset.y / self.radii_mm[1]).powi(2);
                    if distance <= 1.0 {
                        visit(entry as usize, distance);
                    }
                }
            }
        }
    }
}
