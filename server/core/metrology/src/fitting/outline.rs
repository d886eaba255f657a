//! The outline of a feature's points, and their distance from its border.

use nalgebra::{Vector2, Vector3};

use crate::fitting::sample::Samples;
use crate::interface::shape::across;
use crate::params::MIN_INTERIOR_FRACTION;

/// Factor by which cells grow until they are coarser than the sampling.
const CELL_GROWTH: f64 = 1.5;

/// Smallest cell, in margins.
const FIRST_CELL_MARGINS: f64 = 0.5;

/// Largest cell, in margins.
const LAST_CELL_MARGINS: f64 = 4.0;

/// Most cells along one side; a larger feature gets larger cells.
const MAX_CELLS: f64 = 2000.0;

/// Number of covered neighbours from which an empty cell is a pinhole.
const PINHOLE_NEIGHBOURS: usize = 6;

/// Cells of the feature, projected along a direction, that are at least the margin away from empty ones.
pub(crate) struct Outline {
    axes: [Vector3<f64>; 2],
    origin: Vector2<f64>,
    cell_mm: f64,
    columns: usize,
    rows: usize,
    interior: Vec<bool>,
}

impl Outline {
    /// The interior of the region covered by the points, projected along `direction`, with the cell size that keeps
    /// most of them (with smaller cells the sampling leaves holes, larger ones cut a wider border); `None` if the
    /// sampling is so coarse or the feature so small that too few points would remain.
    pub(crate) fn of(samples: &Samples, indices: &[u32], direction: &Vector3<f64>) -> Option<Self> {
        let margin_mm = samples.border_margin_mm();
        let axes = across(direction);
        let flat: Vec<Vector2<f64>> = indices.iter().map(|&idx| project(&axes, &samples.position(idx))).collect();
        let start = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        let (low, high) = flat.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)));
        let mut cell_mm = (FIRST_CELL_MARGINS * margin_mm).max((high - low).max() / MAX_CELLS);
        let mut best: Option<(usize, Self)> = None;
        while cell_mm <= LAST_CELL_MARGINS * margin_mm {
            let outline = Self::with_cell(axes, low, high, (cell_mm, margin_mm), &flat);
            let inside = flat.iter().filter(|p| outline.contains_flat(p)).count();
            if best.as_ref().is_none_or(|(most, _)| inside > *most) {
                best = Some((inside, outline));
            }
            cell_mm *= CELL_GROWTH;
        }
        best.filter(|(inside, _)| *inside as f64 >= MIN_INTERIOR_FRACTION * flat.len() as f64)
            .map(|(_, outline)| outline)
    }

    /// Whether a point, projected along the direction, is inside by the margin.
    pub(crate) fn contains(&self, position: &Vector3<f64>) -> bool {
        self.contains_flat(&project(&self.axes, position))
    }

    fn with_cell(
        axes: [Vector3<f64>; 2],
        low: Vector2<f64>,
        high: Vector2<f64>,
        (cell_mm, margin_mm): (f64, f64),
        flat: &[Vector2<f64>],
    ) -> Self {
        let size = |axis: usize| ((high[axis] - low[axis]) / cell_mm).floor() as usize + 1;
        let (columns, rows) = (size(0), size(1));
        let mut outline =
            Self { axes, origin: low, cell_mm, columns, rows, interior: vec![false; columns * rows] };
        for point in flat {
            if let Some(cell) = outline.cell(point) {
                outline.interior[cell] = true;
            }
        }
        outline.fill_pinholes();
        // One more, because the outermost cells are partly covered.
        outline.erode((margin_mm / cell_mm).ceil() as usize + 1);
        outline
    }

    fn cell(&self, flat: &Vector2<f64>) -> Option<usize> {
        let at = (flat - self.origin) / self.cell_mm;
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < self.columns as f64 && at.y < self.rows as f64;
        inside.then(|| at.y as usize * self.columns + at.x as usize)
    }

    fn contains_flat(&self, flat: &Vector2<f64>) -> bool {
        self.cell(flat).is_some_and(|cell| self.interior[cell])
    }

    /// Fills empty cells with at least [`PINHOLE_NEIGHBOURS`] of eight neighbours: a missing point is not a border.
    fn fill_pinholes(&mut self) {
        let (columns, rows) = (self.columns as isize, self.rows as isize);
        let before = self.interior.clone();
        let covered = |column: isize, row: isize| {
            let exists = (0..columns).contains(&column) && (0..rows).contains(&row);
            exists && before[(row * columns + column) as usize]
        };
        for row in 0..rows {
            for column in 0..columns {
                if !covered(column, row) {
                    let around = (-1..=1).flat_map(|down| (-1..=1).map(move |right| (column + right, row + down)));
                    let n = around.filter(|&(column, row)| covered(column, row)).count();
                    self.interior[(row * columns + column) as usize] = n >= PINHOLE_NEIGHBOURS;
                }
            }
        }
    }

    /// Removes every cell with an empty one within `reach` cells, first along rows, then along columns.
    fn erode(&mut self, reach: usize) {
        let (columns, rows) = (self.columns, self.rows);
        for row in 0..rows {
            erode_line(&mut self.interior, row * columns, 1, columns, reach);
        }
        for column in 0..columns {
            erode_line(&mut self.interior, column, columns, rows, reach);
        }
    }
}

/// Erodes one line of cells; beyond its ends everything is empty.
fn erode_line(cells: &mut [bool], start: usize, stride: usize, length: usize, reach: usize) {
    let line: Vec<bool> = (0..length).map(|k| cells[start + k * stride]).collect();
    let mut gap_before = 0;
    let mut gaps = vec![usize::MAX; length];
    for k in 0..length {
        gap_before = if line[k] { gap_before + 1 } else { 0 };
        gaps[k] = gap_before;
    }
    let mut gap_after = 0;
    for k in (0..length).rev() {
        gap_after = if line[k] { gap_after + 1 } else { 0 };
        cells[start + k * stride] = gaps[k].min(gap_after) > reach;
    }
}

fn project(axes: &[Vector3<f64>; 2], position: &Vector3<f64>) -> Vector2<f64> {
    Vector2::new(axes[0].dot(position), axes[1].dot(position))
}
