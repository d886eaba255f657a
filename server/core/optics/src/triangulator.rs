//! Triangulation by lookup tables: the exact solution, approximated cell by cell on demand (`docs/maths/grating.md`).

mod cell;

use std::sync::OnceLock;

use multiversion::multiversion;
use nalgebra::{DVector, Vector2, Vector3};

use crate::calibration::Calibration;
use crate::calibration::range_sigma_mm;
use crate::cubic::CubicFit;
use crate::frames::{CameraFrame, PointMm};
use cell::{CELL_PX, Cell, DEPTH_LANES, HitsMut, LANES};

/// Largest relative depth error of a cell that is used: 0.02 µm at 400 mm.
const TOLERANCE: f64 = 5e-8;

/// Positions along each side of a cell, corners included, at which the fit is compared with the exact solution.
const CHECKS: usize = 5;

/// Margin left of and above the first pixel's centre at which the first cell begins: pixels extend half a pixel.
const MARGIN_PX: f64 = 1.0;

/// Triangulates many pixels of one calibration, like [`Calibration::triangulate`], within 0.1 µm.
///
/// The ray of a pixel and the inverse depth of its hit are smooth functions of the pixel; within a cell of the image a
/// cubic for each is accurate enough. Cells are fitted on first use and compared with the exact solution; where they
/// are not accurate, and outside of the image, the exact solution is used.
#[derive(Debug)]
pub struct Triangulator {
    calibration: Calibration,
    fit: CubicFit,
    columns: usize,
    rows: usize,
    /// By order, row, column; `None`: the exact solution is used.
    cells: Vec<OnceLock<Option<Box<Cell>>>>,
}

/// Intersections of the rays of several pixels with one sheet: every list has one entry per pixel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Hits {
    /// x of the hit in the camera frame; NaN for no hit, as in all lists.
    pub x_mm: Vec<f64>,
    /// y of the hit.
    pub y_mm: Vec<f64>,
    /// z of the hit.
    pub z_mm: Vec<f64>,
    /// Distance along the ray per pixel across columns, mm/px.
    pub range_by_u: Vec<f64>,
    /// Distance along the ray per pixel across rows, mm/px.
    pub range_by_v: Vec<f64>,
}

impl Hits {
    /// The hit at `idx`; all numbers are NaN for no hit.
    #[inline]
    pub fn at(&self, idx: usize) -> RayHit {
        RayHit {
            in_camera: PointMm::new(Vector3::new(self.x_mm[idx], self.y_mm[idx], self.z_mm[idx])),
            range_by_pixel: Vector2::new(self.range_by_u[idx], self.range_by_v[idx]),
        }
    }

    /// The hits of a range, in order.
    #[inline]
    pub fn in_range(&self, range: std::ops::Range<usize>) -> impl Iterator<Item = RayHit> {
        let [x_mm, y_mm, z_mm, by_u, by_v] =
            [&self.x_mm, &self.y_mm, &self.z_mm, &self.range_by_u, &self.range_by_v]
                .map(|list| &list[range.clone()]);
        let positions = x_mm.iter().zip(y_mm).zip(z_mm).map(|((x, y), z)| PointMm::new(Vector3::new(*x, *y, *z)));
        let by_pixel = by_u.iter().zip(by_v).map(|(by_u, by_v)| Vector2::new(*by_u, *by_v));
        positions.zip(by_pixel).map(|(in_camera, range_by_pixel)| RayHit { in_camera, range_by_pixel })
    }

    fn set(&mut self, idx: usize, hit: &RayHit) {
        let xyz = &hit.in_camera.xyz;
        (self.x_mm[idx], self.y_mm[idx], self.z_mm[idx]) = (xyz.x, xyz.y, xyz.z);
        (self.range_by_u[idx], self.range_by_v[idx]) = (hit.range_by_pixel.x, hit.range_by_pixel.y);
    }
}

/// One ray's hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// Position of the hit.
    pub in_camera: PointMm<CameraFrame>,
    /// Distance along the ray per pixel, d|X| / d(u, v), mm/px.
    pub range_by_pixel: Vector2<f64>,
}

impl RayHit {
    /// Standard deviation of the surface's distance along this ray, mm, where a line with the unit `normal` in the image has
    /// noise of `sigma_px` along it.
    #[inline]
    pub fn noise_sigma_mm(&self, normal: &[f64; 2], sigma_px: f64) -> f64 {
        range_sigma_mm(&self.range_by_pixel, normal, sigma_px)
    }
}

impl Triangulator {
    /// Tables for a calibration; they are filled on demand.
    pub fn new(calibration: Calibration) -> Self {
        let cells_over = |pixels: usize| ((pixels as f64 + MARGIN_PX) / CELL_PX).ceil() as usize;
        let (columns, rows) = (cells_over(calibration.camera.width_px), cells_over(calibration.camera.height_px));
        let n_cells = columns * rows * calibration.orders.len();
        let cells = std::iter::repeat_with(OnceLock::new).take(n_cells).collect();
        Self { calibration, fit: CubicFit::new(), columns, rows, cells }
    }

    /// Fills all tables, for callers with a deadline per frame: about 60 ms for 1280 × 1024 pixels and five orders.
    pub fn fill(&self) {
        for order_idx in 0..self.calibration.orders.len() {
            for (row, column) in (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (row, column)))
            {
                self.cell(order_idx, (column as u32, row as u32));
            }
        }
    }

    /// The calibration of these tables.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Intersects the rays of raw pixels with the sheet of the order at `order_idx`; fastest if consecutive pixels are
    /// neighbours.
    pub fn triangulate_all(&self, order_idx: usize, u_px: &[f64], v_px: &[f64], hits: &mut Hits) {
        let n = u_px.len().min(v_px.len());
        for list in [&mut hits.x_mm, &mut hits.y_mm, &mut hits.z_mm, &mut hits.range_by_u, &mut hits.range_by_v] {
            list.resize(n, f64::NAN);
        }
        find_hits(self, order_idx, &u_px[..n], &v_px[..n], hits);
    }

    /// Only the depths of [`Triangulator::triangulate_all`], mm; NaN for no hit. Order-major: all pixels for the first
    /// order, then for the next.
    pub fn depths(&self, u_px: &[f64], v_px: &[f64], depths_mm: &mut Vec<f64>) {
        let n = u_px.len().min(v_px.len());
        depths_mm.resize(n * self.calibration.orders.len(), f64::NAN);
        find_depths(self, &u_px[..n], &v_px[..n], depths_mm);
    }

    /// One pixel of [`Triangulator::triangulate_all`]; all numbers are NaN for no hit.
    pub fn hit(&self, order_idx: usize, u_px: f64, v_px: f64) -> RayHit {
        match self.cell(order_idx, (place(u_px + MARGIN_PX), place(v_px + MARGIN_PX))) {
            Some(cell) => cell.hit(u_px, v_px),
            None => self.solve(order_idx, u_px, v_px),
        }
    }

    /// The cell of a sheet; `None` where the exact solution must be used.
    #[inline(always)]
    fn cell(&self, order_idx: usize, (column, row): (u32, u32)) -> Option<&Cell> {
        let (column, row) = (column as usize, row as usize);
        if column >= self.columns || row >= self.rows {
            return None;
        }
        let idx = (order_idx * self.rows + row) * self.columns + column;
        self.cells[idx].get_or_init(|| self.fitted(order_idx, column, row)).as_deref()
    }

    /// The exact solution.
    #[cold]
    fn solve(&self, order_idx: usize, u_px: f64, v_px: f64) -> RayHit {
        let order = self.calibration.orders[order_idx];
        let miss = RayHit {
            in_camera: PointMm::new(Vector3::repeat(f64::NAN)),
            range_by_pixel: Vector2::repeat(f64::NAN),
        };
        self.calibration
            .triangulate(order, &Vector2::new(u_px, v_px), None)
            .map_or(miss, |hit| RayHit { in_camera: hit.hit_in_camera, range_by_pixel: hit.range_by_pixel })
    }

    /// A cell fitted to the exact solution; `None` if a ray misses the sheet or the fit is not accurate.
    fn fitted(&self, order_idx: usize, column: usize, row: usize) -> Option<Box<Cell>> {
        let order = self.calibration.orders[order_idx];
        let centre = |idx: usize| (idx as f64 + 0.5) * CELL_PX - MARGIN_PX;
        let (u_px, v_px) = (centre(column), centre(row));
        let mut guess = None;
        let mut exact = |s: f64, t: f64| {
            let pixel = Vector2::new(u_px + 0.5 * CELL_PX * s, v_px + 0.5 * CELL_PX * t);
            let hit = self.calibration.triangulate(order, &pixel, guess)?;
            guess = Some(hit.hit.phi_rad);
            Some((pixel, hit))
        };
        let samples: Vec<[f64; 3]> = CubicFit::nodes()
            .map(|(s, t)| exact(s, t).map(|(_, hit)| [hit.ray.x, hit.ray.y, 1.0 / hit.hit.depth_mm]))
            .collect::<Option<_>>()?;
        let fit =
            |idx: usize| self.fit.fit(&DVector::from_iterator(samples.len(), samples.iter().map(|s| s[idx])));
        let cell = Cell { u_px, v_px, ray_x: fit(0), ray_y: fit(1), inverse_depth: fit(2) };
        let check = |idx: usize| 2.0 * idx as f64 / (CHECKS - 1) as f64 - 1.0;
        let holds = (0..CHECKS * CHECKS).all(|idx| {
            exact(check(idx % CHECKS), check(idx / CHECKS)).is_some_and(|(pixel, hit)| {
                let apart_mm = (cell.hit(pixel.x, pixel.y).in_camera.xyz - hit.hit_in_camera.xyz).norm();
                apart_mm <= TOLERANCE * hit.hit.depth_mm
            })
        });
        holds.then(|| Box::new(cell))
    }
}

/// Column or row of the cell that contains a pixel, from its distance `shifted` to the first cell's edge; `u32::MAX`
/// before that edge.
#[inline(always)]
fn place(shifted: f64) -> u32 {
    if shifted >= 0.0 { (shifted * (1.0 / CELL_PX)) as u32 } else { u32::MAX }
}

/// Whether a position is within the cell that begins at `edge`.
#[inline(always)]
fn is_within(place: f64, edge: f64) -> bool {
    (place >= edge) & (place < edge + CELL_PX)
}

/// See [`Triangulator::triangulate_all`].
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn find_hits(triangulator: &Triangulator, order_idx: usize, u_px: &[f64], v_px: &[f64], hits: &mut Hits) {
    let n = u_px.len();
    let mut first = 0;
    while first < n {
        let (cell, length) = run(&u_px[first..], &v_px[first..]);
        if let Some(cell) = triangulator.cell(order_idx, cell) {
            // Whole vectors: values written beyond the run are overwritten by the next run.
            let range = first..n.min(first + length.next_multiple_of(LANES));
            let out = HitsMut {
                x: &mut hits.x_mm[range.clone()],
                y: &mut hits.y_mm[range.clone()],
                z: &mut hits.z_mm[range.clone()],
                by_u: &mut hits.range_by_u[range.clone()],
                by_v: &mut hits.range_by_v[range.clone()],
            };
            cell.hits(&u_px[range.clone()], &v_px[range], out);
        } else {
            for i in first..first + length {
                hits.set(i, &triangulator.solve(order_idx, u_px[i], v_px[i]));
            }
        }
        first += length;
    }
}

/// See [`Triangulator::depths`].
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn find_depths(triangulator: &Triangulator, u_px: &[f64], v_px: &[f64], depths_mm: &mut [f64]) {
    let n = u_px.len();
    let mut first = 0;
    while first < n {
        let (cell, length) = run(&u_px[first..], &v_px[first..]);
        for order_idx in 0..triangulator.calibration.orders.len() {
            let depths_mm = &mut depths_mm[order_idx * n..][..n];
            if let Some(cell) = triangulator.cell(order_idx, cell) {
                let range = first..n.min(first + length.next_multiple_of(DEPTH_LANES));
                cell.depths(&u_px[range.clone()], &v_px[range.clone()], &mut depths_mm[range]);
            } else {
                for i in first..first + length {
                    depths_mm[i] = triangulator.solve(order_idx, u_px[i], v_px[i]).in_camera.xyz.z;
                }
            }
        }
        first += length;
    }
}

/// Column and row of the first pixel's cell, and the number of consecutive pixels in it; 1 outside the image.
#[inline(always)]
fn run(u_px: &[f64], v_px: &[f64]) -> ((u32, u32), usize) {
    let (column, row) = (place(u_px[0] + MARGIN_PX), place(v_px[0] + MARGIN_PX));
    let (left, top) = (f64::from(column) * CELL_PX, f64::from(row) * CELL_PX);
    let mut length = 1;
    while length + LANES <= u_px.len() {
        let (u, v) = (&u_px[length..length + LANES], &v_px[length..length + LANES]);
        let mut all_within = true;
        for (u, v) in u.iter().zip(v) {
            all_within &= is_within(u + MARGIN_PX, left) & is_within(v + MARGIN_PX, top);
        }
        if !all_within {
            break;
        }
        length += LANES;
    }
    while length < u_px.len()
        && is_within(u_px[length] + MARGIN_PX, left) & is_within(v_px[length] + MARGIN_PX, top)
    {
        length += 1;
    }
    ((column, row), length)
}

#[cfg(test)]
mod tests;
