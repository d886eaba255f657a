//! A grid of cells over the nominal surface, so that deviations are weighted by area and not by point density.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::cad::nominal::Nominal;
use crate::interface::region::Region;

/// Samples of the surface per side of a cell: its area is then known to a few percent.
const SAMPLES_PER_SIDE: f64 = 3.0;

/// Most samples of a surface; the cells are enlarged if more would be needed.
const MAX_SAMPLES: f64 = 2e6;

/// A cell of the surface.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Cell {
    pub(crate) area_mm2: f64,
    pub(crate) n_points: usize,
}

/// Grid cells that the surface passes through.
pub(crate) struct Cells {
    pub(crate) side_mm: f64,
    idx_of: HashMap<[i32; 3], u32>,
    /// Place of every cell in the grid.
    keys: Vec<[i32; 3]>,
    pub(crate) cells: Vec<Cell>,
}

impl Cells {
    /// Cells of about `side_mm`, of the part of the surface in a region.
    pub(crate) fn new(nominal: &Nominal, side_mm: f64, region: Option<&Region>) -> Self {
        let most = (nominal.area_mm2 * SAMPLES_PER_SIDE * SAMPLES_PER_SIDE / MAX_SAMPLES).sqrt();
        let mut cells =
            Self { side_mm: side_mm.max(most), idx_of: HashMap::new(), keys: Vec::new(), cells: Vec::new() };
        let of_sample = (cells.side_mm / SAMPLES_PER_SIDE).powi(2);
        for facet in &nominal.facets {
            let area = facet.area_mm2();
            let n = (area / of_sample).ceil().max(1.0);
            let [a, b, c] = facet.corners;
            for k in 0..n as usize {
                // A low-discrepancy sequence in the unit square (R2), folded onto the triangle.
                let (mut s, mut t) =
                    ((0.5 + 0.754_877_67 * k as f64).fract(), (0.5 + 0.569_840_29 * k as f64).fract());
                if s + t > 1.0 {
                    (s, t) = (1.0 - s, 1.0 - t);
                }
                let at = a + (b - a) * s + (c - a) * t;
                if region.is_none_or(|region| region.contains(&at)) {
                    let idx = cells.get_or_insert(&at);
                    cells.cells[idx as usize].area_mm2 += area / n;
                }
            }
        }
        cells
    }

    /// Area of all cells, mm².
    pub(crate) fn area_mm2(&self) -> f64 {
        self.cells.iter().map(|cell| cell.area_mm2).sum()
    }

    fn key(&self, at: &Vector3<f64>) -> [i32; 3] {
        [0, 1, 2].map(|axis| (at[axis] / self.side_mm).floor() as i32)
    }

    fn get_or_insert(&mut self, at: &Vector3<f64>) -> u32 {
        let key = self.key(at);
        let (keys, cells) = (&mut self.keys, &mut self.cells);
        *self.idx_of.entry(key).or_insert_with(|| {
            keys.push(key);
            cells.push(Cell::default());
            (cells.len() - 1) as u32
        })
    }

    /// The place of a cell in the grid.
    pub(crate) fn key_of(&self, cell: u32) -> [i32; 3] {
        self.keys[cell as usize]
    }

    /// The cell that contains a point of the surface; `None` if no sample of the surface lies in it.
    pub(crate) fn of(&self, at: &Vector3<f64>) -> Option<u32> {
        self.idx_of.get(&self.key(at)).copied()
    }
}
