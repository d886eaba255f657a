//! A cloud seen from above: cells over x and y, as the camera sees the part.

use image::{Rgba, RgbaImage};
use pipeline::Failure;
use scanning::Cloud;

use super::page::data_uri;
use super::plot::{Axis, Plot};
use super::raster::encode_rgba_png;

/// Number of cells across a view.
const CELLS_ACROSS: usize = 240;

/// Largest number of rows of cells, for clouds that are much longer than wide.
const MOST_ROWS: usize = 4 * CELLS_ACROSS;

/// Width of its plot, in units of the drawing.
const PLOT_WIDTH: f64 = 520.0;

/// Cells of equal size over the extent of a cloud.
pub struct TopGrid {
    left_mm: f64,
    top_mm: f64,
    cell_mm: f64,
    columns: usize,
    rows: usize,
}

impl TopGrid {
    /// The cells of a cloud.
    pub fn new(cloud: &Cloud) -> Self {
        let x = bounds(cloud.points.iter().map(|point| point.x_mm));
        let y = bounds(cloud.points.iter().map(|point| point.y_mm));
        let cell_mm = ((x.1 - x.0) / CELLS_ACROSS as f64).max(1e-6);
        let rows = (((y.1 - y.0) / cell_mm).ceil() as usize).clamp(1, MOST_ROWS);
        Self { left_mm: x.0, top_mm: y.0, cell_mm, columns: CELLS_ACROSS + 1, rows }
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.columns * self.rows
    }

    /// Index of the cell that contains a point.
    pub fn cell(&self, x_mm: f64, y_mm: f64) -> usize {
        let column = (((x_mm - self.left_mm) / self.cell_mm) as usize).min(self.columns - 1);
        let row = (((y_mm - self.top_mm) / self.cell_mm) as usize).min(self.rows - 1);
        row * self.columns + column
    }

    /// One pixel per cell, in the colour of its index; transparent without one.
    pub fn image(&self, colour: impl Fn(usize) -> Option<[u8; 3]>) -> RgbaImage {
        RgbaImage::from_fn(self.columns as u32, self.rows as u32, |column, row| {
            match colour(row as usize * self.columns + column as usize) {
                Some([red, green, blue]) => Rgba([red, green, blue, 255]),
                None => Rgba([0; 4]),
            }
        })
    }

    /// The image of its cells with axes, for a page.
    ///
    /// # Errors
    /// The image cannot be encoded.
    pub fn plot(&self, image: &RgbaImage) -> Result<Plot, Failure> {
        let [[left, right], [top, bottom]] = self.limits_mm();
        let height = PLOT_WIDTH * (bottom - top) / (right - left);
        let (x, y) = (Axis::new(left, right, "x, mm"), Axis::new(bottom, top, "y, mm"));
        let mut plot = Plot::new(x, y, PLOT_WIDTH, height);
        plot.backdrop(&data_uri("image/png", &encode_rgba_png(image)?));
        Ok(plot)
    }

    /// Its limits along x and along y, mm.
    fn limits_mm(&self) -> [[f64; 2]; 2] {
        let right_mm = self.left_mm + self.cell_mm * self.columns as f64;
        let bottom_mm = self.top_mm + self.cell_mm * self.rows as f64;
        [[self.left_mm, right_mm], [self.top_mm, bottom_mm]]
    }

    /// Its width and height, mm.
    pub fn size_mm(&self) -> [f64; 2] {
        self.limits_mm().map(|[low, high]| high - low)
    }
}

fn bounds(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low < high { (low, high) } else { (0.0, 1.0) }
}

/// A point of a cloud.
#[cfg(test)]
pub fn point_at([x_mm, y_mm, z_mm]: [f64; 3]) -> scanning::CloudPoint {
    scanning::CloudPoint {
        x_mm,
        y_mm,
        z_mm,
        order: 0,
        frame: 0,
        u_px: 0.0,
        v_px: 0.0,
        intensity: 0.0,
        sigma_mm: 0.0,
    }
}
