//! The lateral positions that are already covered by a layer, with the depth of the layer.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use nalgebra::Vector3;

/// Column and row.
type Cell = (i32, i32);

/// A grid over x and y; a cell holds the depths of the triangles over its centre.
pub(super) struct Coverage {
    cell_mm: f64,
    /// Layers closer than this in depth are the same surface.
    same_depth_mm: f64,
    /// The first depth of every cell. Nearly all cells have only one: a list per cell would take most of the
    /// memory of a mesh.
    first_mm: HashMap<Cell, f32>,
    /// Further depths of the few cells that have several.
    more_mm: HashMap<Cell, Vec<f32>>,
}

impl Coverage {
    pub(super) fn new(cell_mm: f64, same_depth_mm: f64) -> Self {
        Self { cell_mm, same_depth_mm, first_mm: HashMap::new(), more_mm: HashMap::new() }
    }

    /// Whether the centre of a triangle lies on a covered surface.
    pub(super) fn covers(&self, corners: &[Vector3<f64>; 3]) -> bool {
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        self.has_layer(self.cell(centre.x, centre.y), centre.z)
    }

    fn has_layer(&self, cell: Cell, depth_mm: f64) -> bool {
        let is_same = |known_mm: &f32| (f64::from(*known_mm) - depth_mm).abs() <= self.same_depth_mm;
        self.first_mm.get(&cell).is_some_and(is_same)
            || self.more_mm.get(&cell).is_some_and(|depths_mm| depths_mm.iter().any(is_same))
    }

    /// Marks every cell whose centre the triangle contains.
    pub(super) fn add(&mut self, corners: &[Vector3<f64>; 3]) {
        let xs = corners.map(|c| c.x);
        let ys = corners.map(|c| c.y);
        let (low, high) = (self.cell(least(&xs), least(&ys)), self.cell(greatest(&xs), greatest(&ys)));
        for column in low.0..=high.0 {
            for row in low.1..=high.1 {
                let x = (column as f64 + 0.5) * self.cell_mm;
                let y = (row as f64 + 0.5) * self.cell_mm;
                if let Some(depth_mm) = depth_inside(corners, x, y) {
                    self.add_depth((column, row), depth_mm);
                }
            }
        }
    }

    fn add_depth(&mut self, cell: Cell, depth_mm: f64) {
        if self.has_layer(cell, depth_mm) {
            return;
        }
        match self.first_mm.entry(cell) {
            Entry::Vacant(free) => _ = free.insert(depth_mm as f32),
            Entry::Occupied(_) => self.more_mm.entry(cell).or_default().push(depth_mm as f32),
        }
    }

    fn cell(&self, x: f64, y: f64) -> Cell {
        ((x / self.cell_mm).floor() as i32, (y / self.cell_mm).floor() as i32)
    }
}

fn least(values: &[f64; 3]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

fn greatest(values: &[f64; 3]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// The depth of a triangle over (x, y), by barycentric coordinates; `None` outside it.
fn depth_inside(corners: &[Vector3<f64>; 3], x: f64, y: f64) -> Option<f64> {
    let [a, b, c] = corners;
    let area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    let second = ((x - a.x) * (c.y - a.y) - (c.x - a.x) * (y - a.y)) / area;
    let third = ((b.x - a.x) * (y - a.y) - (x - a.x) * (b.y - a.y)) / area;
    let inside = second >= 0.0 && third >= 0.0 && second + third <= 1.0;
    inside.then(|| a.z + second * (b.z - a.z) + third * (c.z - a.z))
}
