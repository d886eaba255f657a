//! A cell of the image for one sheet, and the intersections of its pixels' rays with that sheet.

use nalgebra::{Vector2, Vector3};

use super::RayHit;
use crate::cubic::{Cubic, gradient, value};
use crate::frames::PointMm;

/// Width of a cell. Over 64 pixels a cubic approximates lenses and sheets of usual stations to a nanometre.
pub const CELL_PX: f64 = 64.0;

/// Pixels whose hits are computed together: as many numbers as fit into one vector register.
pub const LANES: usize = 8;

/// Pixels whose depths are computed together: lines are sampled about four times per cell.
pub const DEPTH_LANES: usize = 4;

/// A cell of the image for one sheet: camera ray and inverse depth as functions of the position within the cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Centre of the cell, column.
    pub u_px: f64,
    /// Centre of the cell, row.
    pub v_px: f64,
    /// x_h of the camera ray (x_h, y_h, 1).
    pub ray_x: Cubic,
    /// y_h of the camera ray.
    pub ray_y: Cubic,
    /// 1 / z of the hit, per mm.
    pub inverse_depth: Cubic,
}

/// Destination of hits.
pub struct HitsMut<'a> {
    pub x: &'a mut [f64],
    pub y: &'a mut [f64],
    pub z: &'a mut [f64],
    pub by_u: &'a mut [f64],
    pub by_v: &'a mut [f64],
}

impl Cell {
    /// The hit of the ray of one pixel: z = 1/q, X = z·(x_h, y_h, 1); d|X| along the ray = |D|·dz = −|D|·z²·dq.
    #[inline(always)]
    pub fn hit(&self, u_px: f64, v_px: f64) -> RayHit {
        let (s, t) = self.place(u_px, v_px);
        let depth = 1.0 / value(&self.inverse_depth, s, t);
        let (ray_x, ray_y) = (value(&self.ray_x, s, t), value(&self.ray_y, s, t));
        let (by_s, by_t) = gradient(&self.inverse_depth, s, t);
        let length = (ray_x * ray_x + ray_y * ray_y + 1.0).sqrt();
        let range = -(length * depth * depth) * (2.0 / CELL_PX);
        RayHit {
            in_camera: PointMm::new(Vector3::new(ray_x * depth, ray_y * depth, depth)),
            range_by_pixel: Vector2::new(range * by_s, range * by_t),
        }
    }

    /// The hits of the rays of several pixels.
    #[inline(always)]
    pub fn hits(&self, u_px: &[f64], v_px: &[f64], mut hits: HitsMut) {
        let whole = u_px.len() / LANES * LANES;
        self.whole_vectors(&u_px[..whole], &v_px[..whole], hits.part(0, whole));
        let n = u_px.len() - whole;
        if n > 0 {
            let rest = hits.part(whole, n);
            let [mut x, mut y, mut z, mut by_u, mut by_v] = [[0.0; LANES]; 5];
            let out = HitsMut { x: &mut x, y: &mut y, z: &mut z, by_u: &mut by_u, by_v: &mut by_v };
            let (u_px, v_px) = (padded::<LANES>(&u_px[whole..]), padded::<LANES>(&v_px[whole..]));
            self.whole_vectors(&u_px, &v_px, out);
            for (list, found) in [(rest.x, x), (rest.y, y), (rest.z, z), (rest.by_u, by_u), (rest.by_v, by_v)] {
                list.copy_from_slice(&found[..n]);
            }
        }
    }

    /// [`Cell::hits`] for a multiple of [`LANES`] pixels.
    #[inline(always)]
    fn whole_vectors(&self, u_px: &[f64], v_px: &[f64], hits: HitsMut) {
        let n = u_px.len() / LANES * LANES;
        let HitsMut { x, y, z, by_u, by_v } = hits;
        let (u_px, v_px, x, y, z) = (&u_px[..n], &v_px[..n], &mut x[..n], &mut y[..n], &mut z[..n]);
        let (by_u, by_v) = (&mut by_u[..n], &mut by_v[..n]);
        for i in 0..n {
            let RayHit { in_camera, range_by_pixel } = self.hit(u_px[i], v_px[i]);
            (x[i], y[i], z[i]) = (in_camera.xyz.x, in_camera.xyz.y, in_camera.xyz.z);
            (by_u[i], by_v[i]) = (range_by_pixel.x, range_by_pixel.y);
        }
    }

    /// The depths alone.
    #[inline(always)]
    pub fn depths(&self, u_px: &[f64], v_px: &[f64], depths_mm: &mut [f64]) {
        let whole = u_px.len() / DEPTH_LANES * DEPTH_LANES;
        for first in (0..whole).step_by(DEPTH_LANES) {
            let (u_px, v_px) = (padded(&u_px[first..whole]), padded(&v_px[first..whole]));
            depths_mm[first..][..DEPTH_LANES].copy_from_slice(&self.few_depths(&u_px, &v_px));
        }
        if whole < u_px.len() {
            let found = self.few_depths(&padded(&u_px[whole..]), &padded(&v_px[whole..]));
            depths_mm[whole..].copy_from_slice(&found[..u_px.len() - whole]);
        }
    }

    #[inline(always)]
    fn few_depths(&self, u_px: &[f64; DEPTH_LANES], v_px: &[f64; DEPTH_LANES]) -> [f64; DEPTH_LANES] {
        let mut depths_mm = [0.0; DEPTH_LANES];
        for i in 0..DEPTH_LANES {
            let (s, t) = self.place(u_px[i], v_px[i]);
            depths_mm[i] = 1.0 / value(&self.inverse_depth, s, t);
        }
        depths_mm
    }

    #[inline(always)]
    fn place(&self, u_px: f64, v_px: f64) -> (f64, f64) {
        ((u_px - self.u_px) * (2.0 / CELL_PX), (v_px - self.v_px) * (2.0 / CELL_PX))
    }
}

impl HitsMut<'_> {
    #[inline(always)]
    fn part(&mut self, first: usize, n: usize) -> HitsMut<'_> {
        HitsMut {
            x: &mut self.x[first..][..n],
            y: &mut self.y[first..][..n],
            z: &mut self.z[first..][..n],
            by_u: &mut self.by_u[first..][..n],
            by_v: &mut self.by_v[first..][..n],
        }
    }
}

/// The first `N` pixels, padded with the first one.
#[inline(always)]
fn padded<const N: usize>(pixels: &[f64]) -> [f64; N] {
    if let Some(whole) = pixels.first_chunk::<N>() {
        return *whole;
    }
    let mut all = [pixels[0]; N];
    all[..pixels.len()].copy_from_slice(pixels);
    all
}
