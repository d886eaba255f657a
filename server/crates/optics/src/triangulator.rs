//! Triangulation by tables: the exact solution, fitted cell by cell where it is needed (`docs/maths/grating.md`).

use std::sync::OnceLock;

use multiversion::multiversion;
use nalgebra::{DVector, Vector2, Vector3};

use crate::calibration::Calibration;
use crate::cubic::{Cubic, CubicFit, slopes, value};
use crate::frames::{CameraFrame, PointMm};

/// Width of a cell. Over 64 pixels a cubic follows lenses and sheets of usual stations to a nanometre.
const CELL_PX: f64 = 64.0;

/// Largest difference to the exact hit in a cell that is used, as a share of the depth: 0.02 µm at 400 mm.
const TOLERANCE: f64 = 5e-8;

/// Places along each side of a cell, corners included, where the fit is compared with the exact solution.
const CHECKS: usize = 5;

/// Left of and above the first pixel's centre, where the first cell begins: pixels reach half a pixel out.
const MARGIN_PX: f64 = 1.0;

/// Pixels that are asked together whether they lie in one cell.
const TOGETHER: usize = 8;

/// Triangulates many pixels of one calibration, as [`Calibration::triangulate`] does, within 0.1 µm.
///
/// The ray of a pixel and the inverse depth of its hit are smooth functions of the pixel; over a cell of the image a
/// cubic each is as good as the solution. Cells are fitted when first met and compared with the exact solution; where
/// they do not hold, and outside of the image, the exact solution itself answers.
#[derive(Debug)]
pub struct Triangulator {
    calibration: Calibration,
    fit: CubicFit,
    columns: usize,
    rows: usize,
    /// By order, row, column; `None`: the exact solution has to answer.
    cells: Vec<OnceLock<Option<Box<Cell>>>>,
}

/// Hits of the rays through several pixels on one sheet: one entry a pixel in every list.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Hits {
    /// x of the hit in the camera frame; NaN for no hit, as in all lists.
    pub x_mm: Vec<f64>,
    /// y of the hit.
    pub y_mm: Vec<f64>,
    /// z of the hit.
    pub z_mm: Vec<f64>,
    /// Distance along the ray per pixel across columns, mm/px.
    pub reach_by_u: Vec<f64>,
    /// Distance along the ray per pixel across rows, mm/px.
    pub reach_by_v: Vec<f64>,
}

impl Hits {
    /// One of them; all numbers NaN for no hit.
    #[inline]
    pub fn at(&self, idx: usize) -> RayHit {
        RayHit {
            in_camera: PointMm::new(Vector3::new(self.x_mm[idx], self.y_mm[idx], self.z_mm[idx])),
            reach_by_pixel: Vector2::new(self.reach_by_u[idx], self.reach_by_v[idx]),
        }
    }
}

/// One ray's hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// Where the light hit.
    pub in_camera: PointMm<CameraFrame>,
    /// Distance along the ray per pixel, d|X| / d(u, v), mm/px.
    pub reach_by_pixel: Vector2<f64>,
}

impl RayHit {
    /// Standard deviation along the ray, mm, of a pixel noise of `sigma_px` along the image direction `normal`.
    pub fn noise_sigma_mm(&self, normal: &[f64; 2], sigma_px: f64) -> f64 {
        (self.reach_by_pixel.x * normal[0] + self.reach_by_pixel.y * normal[1]).abs() * sigma_px
    }
}

/// What a cell of the image sees of one sheet, by the place within it.
#[derive(Debug, Clone, PartialEq)]
struct Cell {
    /// Centre of the cell.
    u_px: f64,
    v_px: f64,
    /// The camera ray (x_h, y_h, 1).
    ray_x: Cubic,
    ray_y: Cubic,
    /// 1 / z of the hit, per mm.
    inverse_depth: Cubic,
}

impl Triangulator {
    /// Tables for a calibration; they are filled as they are used.
    pub fn new(calibration: Calibration) -> Self {
        let cells_over = |pixels: usize| ((pixels as f64 + MARGIN_PX) / CELL_PX).ceil() as usize;
        let (columns, rows) = (cells_over(calibration.camera.width_px), cells_over(calibration.camera.height_px));
        let n_cells = columns * rows * calibration.orders.len();
        let cells = std::iter::repeat_with(OnceLock::new).take(n_cells).collect();
        Self { calibration, fit: CubicFit::new(), columns, rows, cells }
    }

    /// Fills all tables, for those who cannot wait once pixels come: some 60 ms for 1280 × 1024 pixels and five orders.
    pub fn fill(&self) {
        for order_idx in 0..self.calibration.orders.len() {
            for (row, column) in (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (row, column)))
            {
                self.cell(order_idx, (column as u32, row as u32));
            }
        }
    }

    /// Whose tables these are.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The hits of raw pixels on the sheet of the order at `order_idx`; quickest for neighbours one after another.
    pub fn triangulate_all(&self, order_idx: usize, u_px: &[f64], v_px: &[f64], hits: &mut Hits) {
        let n = u_px.len().min(v_px.len());
        for list in [&mut hits.x_mm, &mut hits.y_mm, &mut hits.z_mm, &mut hits.reach_by_u, &mut hits.reach_by_v] {
            list.resize(n, f64::NAN);
        }
        let (u_px, v_px) = (&u_px[..n], &v_px[..n]);
        let mut first = 0;
        while first < n {
            let (cell, length) = run(&u_px[first..], &v_px[first..]);
            let range = first..first + length;
            let out = HitsMut {
                x: &mut hits.x_mm[range.clone()],
                y: &mut hits.y_mm[range.clone()],
                z: &mut hits.z_mm[range.clone()],
                by_u: &mut hits.reach_by_u[range.clone()],
                by_v: &mut hits.reach_by_v[range.clone()],
            };
            let (u_px, v_px) = (&u_px[range.clone()], &v_px[range]);
            match self.cell(order_idx, cell) {
                Some(cell) => evaluate(cell, u_px, v_px, out),
                None => self.solve(order_idx, u_px, v_px, out),
            }
            first += length;
        }
    }

    /// The depths alone of what [`Triangulator::triangulate_all`] finds, mm; NaN for no hit. All pixels under the first
    /// order, then under the next.
    pub fn depths(&self, u_px: &[f64], v_px: &[f64], depths_mm: &mut Vec<f64>) {
        let n = u_px.len().min(v_px.len());
        let n_orders = self.calibration.orders.len();
        depths_mm.resize(n * n_orders, f64::NAN);
        let (u_px, v_px) = (&u_px[..n], &v_px[..n]);
        let mut first = 0;
        while first < n {
            let (cell, length) = run(&u_px[first..], &v_px[first..]);
            let (u_px, v_px) = (&u_px[first..][..length], &v_px[first..][..length]);
            for order_idx in 0..n_orders {
                let depths_mm = &mut depths_mm[order_idx * n + first..][..length];
                match self.cell(order_idx, cell) {
                    Some(cell) => evaluate_depths(cell, u_px, v_px, depths_mm),
                    None => self.solve_depths(order_idx, u_px, v_px, depths_mm),
                }
            }
            first += length;
        }
    }

    /// What a cell of the image sees of a sheet; `None` where the exact solution has to answer.
    #[inline(always)]
    fn cell(&self, order_idx: usize, (column, row): (u32, u32)) -> Option<&Cell> {
        let (column, row) = (column as usize, row as usize);
        if column >= self.columns || row >= self.rows {
            return None;
        }
        let idx = (order_idx * self.rows + row) * self.columns + column;
        self.cells[idx].get_or_init(|| self.fitted(order_idx, column, row)).as_deref()
    }

    /// The exact solution, pixel by pixel.
    fn solve(&self, order_idx: usize, u_px: &[f64], v_px: &[f64], hits: HitsMut) {
        let order = self.calibration.orders[order_idx];
        for (idx, (u, v)) in u_px.iter().zip(v_px).enumerate() {
            let hit = self.calibration.triangulate(order, &Vector2::new(*u, *v), None);
            let xyz = hit.map_or([f64::NAN; 3], |hit| hit.hit_in_camera.xyz.into());
            let reach = hit.map_or([f64::NAN; 2], |hit| hit.reach_by_pixel.into());
            (hits.x[idx], hits.y[idx], hits.z[idx]) = (xyz[0], xyz[1], xyz[2]);
            (hits.by_u[idx], hits.by_v[idx]) = (reach[0], reach[1]);
        }
    }

    fn solve_depths(&self, order_idx: usize, u_px: &[f64], v_px: &[f64], depths_mm: &mut [f64]) {
        let order = self.calibration.orders[order_idx];
        for (depth_mm, (u, v)) in depths_mm.iter_mut().zip(u_px.iter().zip(v_px)) {
            let hit = self.calibration.triangulate(order, &Vector2::new(*u, *v), None);
            *depth_mm = hit.map_or(f64::NAN, |hit| hit.hit_in_camera.xyz.z);
        }
    }

    /// A cell fitted to the exact solution; `None` where a ray misses the sheet or the fit does not hold.
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
        let samples: Vec<[f64; 3]> = CubicFit::places()
            .map(|(s, t)| exact(s, t).map(|(_, hit)| [hit.ray.x, hit.ray.y, 1.0 / hit.hit.depth_mm]))
            .collect::<Option<_>>()?;
        let fit =
            |idx: usize| self.fit.fit(&DVector::from_iterator(samples.len(), samples.iter().map(|s| s[idx])));
        let cell = Cell { u_px, v_px, ray_x: fit(0), ray_y: fit(1), inverse_depth: fit(2) };
        let check = |idx: usize| 2.0 * idx as f64 / (CHECKS - 1) as f64 - 1.0;
        let holds = (0..CHECKS * CHECKS).all(|idx| {
            exact(check(idx % CHECKS), check(idx / CHECKS)).is_some_and(|(pixel, hit)| {
                let apart_mm = (cell.hit(pixel.x, pixel.y) - hit.hit_in_camera.xyz).norm();
                apart_mm <= TOLERANCE * hit.hit.depth_mm
            })
        });
        holds.then(|| Box::new(cell))
    }
}

impl Cell {
    fn hit(&self, u_px: f64, v_px: f64) -> Vector3<f64> {
        let place = |pixel: f64, centre: f64| (pixel - centre) * (2.0 / CELL_PX);
        let (s, t) = (place(u_px, self.u_px), place(v_px, self.v_px));
        let depth = 1.0 / value(&self.inverse_depth, s, t);
        Vector3::new(value(&self.ray_x, s, t), value(&self.ray_y, s, t), 1.0) * depth
    }
}

/// Column or row of the cell of a pixel, which lies `shifted` from where the first cell begins; beyond the image a number
/// that no cell has.
#[inline(always)]
fn place(shifted: f64) -> u32 {
    if shifted >= 0.0 { (shifted * (1.0 / CELL_PX)) as u32 } else { u32::MAX }
}

/// Whether a place is within the cell that begins at `edge`.
#[inline(always)]
fn is_within(place: f64, edge: f64) -> bool {
    (place >= edge) & (place < edge + CELL_PX)
}

/// Column and row of the cell of the first pixel, and how many pixels from the first on lie in it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn run(u_px: &[f64], v_px: &[f64]) -> ((u32, u32), usize) {
    let (column, row) = (place(u_px[0] + MARGIN_PX), place(v_px[0] + MARGIN_PX));
    let (left, top) = (f64::from(column) * CELL_PX, f64::from(row) * CELL_PX);
    let mut length = 1;
    while length + TOGETHER <= u_px.len() {
        let (u, v) = (&u_px[length..length + TOGETHER], &v_px[length..length + TOGETHER]);
        let mut all_within = true;
        for (u, v) in u.iter().zip(v) {
            all_within &= is_within(u + MARGIN_PX, left) & is_within(v + MARGIN_PX, top);
        }
        if !all_within {
            break;
        }
        length += TOGETHER;
    }
    while length < u_px.len()
        && (place(u_px[length] + MARGIN_PX), place(v_px[length] + MARGIN_PX)) == (column, row)
    {
        length += 1;
    }
    ((column, row), length)
}

/// Where the hits of one run go.
struct HitsMut<'a> {
    x: &'a mut [f64],
    y: &'a mut [f64],
    z: &'a mut [f64],
    by_u: &'a mut [f64],
    by_v: &'a mut [f64],
}

/// z = 1/q, X = z·(x_h, y_h, 1); d|X| along the ray = |D|·dz = −|D|·z²·dq.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn evaluate(cell: &Cell, u_px: &[f64], v_px: &[f64], hits: HitsMut) {
    let n = u_px.len();
    let HitsMut { x, y, z, by_u, by_v } = hits;
    let (v_px, x, y, z) = (&v_px[..n], &mut x[..n], &mut y[..n], &mut z[..n]);
    let (by_u, by_v) = (&mut by_u[..n], &mut by_v[..n]);
    for i in 0..n {
        let s = (u_px[i] - cell.u_px) * (2.0 / CELL_PX);
        let t = (v_px[i] - cell.v_px) * (2.0 / CELL_PX);
        let depth = 1.0 / value(&cell.inverse_depth, s, t);
        let (ray_x, ray_y) = (value(&cell.ray_x, s, t), value(&cell.ray_y, s, t));
        let (by_s, by_t) = slopes(&cell.inverse_depth, s, t);
        let length = (ray_x * ray_x + ray_y * ray_y + 1.0).sqrt();
        let reach = -(length * depth * depth) * (2.0 / CELL_PX);
        (x[i], y[i], z[i]) = (ray_x * depth, ray_y * depth, depth);
        (by_u[i], by_v[i]) = (reach * by_s, reach * by_t);
    }
}

/// The depths of [`evaluate`].
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn evaluate_depths(cell: &Cell, u_px: &[f64], v_px: &[f64], depths_mm: &mut [f64]) {
    let n = u_px.len();
    let (v_px, depths_mm) = (&v_px[..n], &mut depths_mm[..n]);
    for i in 0..n {
        let s = (u_px[i] - cell.u_px) * (2.0 / CELL_PX);
        let t = (v_px[i] - cell.v_px) * (2.0 / CELL_PX);
        depths_mm[i] = 1.0 / value(&cell.inverse_depth, s, t);
    }
}

#[cfg(test)]
mod tests;
