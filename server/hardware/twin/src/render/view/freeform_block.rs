//! Hills along a segment of an image row: Newton steps from the tangent planes of the row above.

use multiversion::multiversion;
use nalgebra::Vector3;

use crate::arithmetic::exp;
use crate::params::PART_REFLECTANCE;
use crate::part::freeform::{Freeform, Hill};
use crate::render::view::block::{Block, NOTHING};
use crate::render::view::lit_pixels::WORD_PX;
use crate::render::view::pixel_hits::PixelHits;

/// Newton steps from a guess; from the tangent plane of the row above two suffice, from the bare plate five.
const MAX_STEPS: usize = 8;

/// Height above the surface, mm, from which one last step along the tangent plane ends within 1e-15 mm of it.
const LAST_STEP_MM: f64 = 1e-7;

/// The hits of the row above, word by word.
#[derive(Debug, Default)]
pub(crate) struct Above {
    words: Vec<AboveWord>,
}

/// Tangent planes normal · X = offset.
#[derive(Debug, Clone)]
struct AboveWord {
    row: usize,
    normal: [Block; 3],
    offset: Block,
}

/// Rays in the plate's frame and the surface below their current ends.
struct Search {
    from: Vector3<f64>,
    dir: [Block; 3],
    at: [Block; 2],
    height: Block,
    slope: [Block; 2],
}

impl Above {
    /// [`crate::render::view::pixel_hits::View::cast`] of hills.
    pub(crate) fn cast(
        &mut self,
        part: &Freeform,
        moved: &Vector3<f64>,
        (u, v): (usize, usize),
        n: usize,
        hits: &mut PixelHits,
    ) {
        let (word, first) = (u / WORD_PX, u % WORD_PX);
        if self.words.len() <= word {
            let nothing = AboveWord { row: usize::MAX, normal: [NOTHING; 3], offset: NOTHING };
            self.words.resize(word + 1, nothing);
        }
        let above = &mut self.words[word];
        if above.row.checked_add(1) != Some(v) {
            above.offset = NOTHING;
        }
        above.row = v;
        let plate_offset = part.plate.normal().dot(&(part.plate.point_mm + moved));
        guess(above, first, &part.plate.normal(), plate_offset, n, hits);
        let from = part.plate.local(&(-moved - part.plate.point_mm));
        let mut search =
            Search { from, dir: [NOTHING; 3], at: [NOTHING; 2], height: NOTHING, slope: [NOTHING; 2] };
        newton_steps(part, n, &mut search, hits);
        for lane in 0..n {
            if hits.ray_length[lane].is_nan() {
                match part.hit(&-moved, &hits.ray(lane)) {
                    Some(hit) => hits.set_hit(lane, hit.ray_length, &hit.normal, hit.reflectance),
                    None => continue,
                }
            }
        }
        above.keep(first, n, hits);
    }
}

impl AboveWord {
    fn keep(&mut self, first: usize, n: usize, hits: &PixelHits) {
        self.offset[..first].fill(f64::NAN);
        self.offset[first + n..].fill(f64::NAN);
        for lane in 0..n {
            let normal = hits.normal(lane);
            self.offset[first + lane] = normal.dot(&hits.ray(lane)) * hits.ray_length[lane];
            (0..3).for_each(|axis| self.normal[axis][first + lane] = normal[axis]);
        }
    }
}

/// Ray lengths to the tangent planes above, or to the plate where there are none.
#[multiversion(targets("x86_64+avx2"))]
fn guess(
    above: &AboveWord,
    first: usize,
    plate_normal: &Vector3<f64>,
    plate_offset_mm: f64,
    n: usize,
    hits: &mut PixelHits,
) {
    let [nx, ny, nz] = above.normal.each_ref().map(|axis| &axis[first..first + n]);
    let offset = &above.offset[first..first + n];
    let PixelHits { rays: [x, y], ray_length, .. } = hits;
    let (x, y, ray_length) = (&x[..n], &y[..n], &mut ray_length[..n]);
    for lane in 0..n {
        let tangent = offset[lane] / (nx[lane] * x[lane] + ny[lane] * y[lane] + nz[lane]);
        let plate = plate_offset_mm / (plate_normal.x * x[lane] + plate_normal.y * y[lane] + plate_normal.z);
        ray_length[lane] = if tangent > 0.0 { tangent } else { plate };
    }
}

/// Newton steps for all rays at once; the ray length becomes NaN where they do not converge or where the curvature
/// bound does not prove that the hit is the first ([`Freeform::hit_from`] is the same for one ray).
#[multiversion(targets("x86_64+avx2"))]
fn newton_steps(part: &Freeform, n: usize, search: &mut Search, hits: &mut PixelHits) {
    let Search { from, dir, at, height, slope } = search;
    let [wx, wy, wz] = dir.each_mut().map(|axis| &mut axis[..n]);
    let [ax, ay] = at.each_mut().map(|axis| &mut axis[..n]);
    let [sx, sy] = slope.each_mut().map(|axis| &mut axis[..n]);
    let (height, ray_length) = (&mut height[..n], &mut hits.ray_length[..n]);
    let [x, y] = hits.rays.each_ref().map(|axis| &axis[..n]);
    let axes = &part.plate.axes;
    for (axis, dir) in [&mut *wx, &mut *wy, &mut *wz].into_iter().enumerate() {
        turn([axes[(0, axis)], axes[(1, axis)], axes[(2, axis)]], x, y, dir);
    }
    for _ in 0..MAX_STEPS {
        advance(from.x, wx, ray_length, ax);
        advance(from.y, wy, ray_length, ay);
        for slot in [&mut *height, &mut *sx, &mut *sy] {
            slot.fill(0.0);
        }
        for hill in &part.hills {
            add_hill(hill, ax, ay, height, sx, sy);
        }
        if step(from.z, [wx, wy, wz], [sx, sy], height, ray_length) == 0 {
            break;
        }
    }
    let ([nx, ny, nz], reflectance) = (&mut hits.normal, &mut hits.reflectance[..n]);
    keep_proven(part, from.z, [wx, wy, wz], [sx, sy], height, ray_length);
    for (axis, normal) in [nx, ny, nz].into_iter().enumerate() {
        camera_normals([axes[(axis, 0)], axes[(axis, 1)], axes[(axis, 2)]], sx, sy, &mut normal[..n]);
    }
    reflectance.fill(PART_REFLECTANCE);
}

/// One component of the rays (x, y, 1) in the plate's frame.
#[inline(always)]
fn turn(axis: [f64; 3], x: &[f64], y: &[f64], dir: &mut [f64]) {
    for ((dir, x), y) in dir.iter_mut().zip(x).zip(y) {
        *dir = axis[0] * x + axis[1] * y + axis[2];
    }
}

#[inline(always)]
fn advance(from: f64, dir: &[f64], ray_length: &[f64], at: &mut [f64]) {
    for ((at, dir), ray_length) in at.iter_mut().zip(dir).zip(ray_length) {
        *at = from + dir * ray_length;
    }
}

/// Adds a hill to the heights and slopes at positions (x, y), as [`Freeform::height_mm`] does for one; beyond its
/// cut-off, 1e-14 mm remain.
#[inline(always)]
fn add_hill(hill: &Hill, x: &[f64], y: &[f64], height: &mut [f64], slope_x: &mut [f64], slope_y: &mut [f64]) {
    let curvature = 1.0 / (hill.sigma_mm * hill.sigma_mm);
    let n = x.len();
    let (y, height, slope_x, slope_y) = (&y[..n], &mut height[..n], &mut slope_x[..n], &mut slope_y[..n]);
    for lane in 0..n {
        let (dx, dy) = (x[lane] - hill.at_mm[0], y[lane] - hill.at_mm[1]);
        let exponent = (dx * dx + dy * dy) * curvature / 2.0;
        let part = hill.height_mm * exp(-exponent);
        height[lane] += part;
        slope_x[lane] -= part * dx * curvature;
        slope_y[lane] -= part * dy * curvature;
    }
}

/// One Newton step of every ray; turns the surface's heights into the rays' heights above it, and counts those too high
/// for this to be the last step.
#[inline(always)]
fn step(from_z: f64, dir: [&[f64]; 3], slope: [&[f64]; 2], height: &mut [f64], ray_length: &mut [f64]) -> u64 {
    let n = ray_length.len();
    let ([wx, wy, wz], [sx, sy]) = (dir.map(|axis| &axis[..n]), slope.map(|axis| &axis[..n]));
    let height = &mut height[..n];
    let mut high = 0;
    for lane in 0..n {
        let above = from_z + wz[lane] * ray_length[lane] - height[lane];
        let closing = sx[lane] * wx[lane] + sy[lane] * wy[lane] - wz[lane];
        ray_length[lane] += above / closing;
        height[lane] = above;
        high += u64::from(above.abs() >= LAST_STEP_MM);
    }
    high
}

/// Sets NaN where the curvature bound does not prove the hit to be the first (`Freeform::is_proven_free`).
#[inline(always)]
fn keep_proven(
    part: &Freeform,
    from_z: f64,
    dir: [&[f64]; 3],
    slope: [&[f64]; 2],
    above: &[f64],
    ray_length: &mut [f64],
) {
    let n = ray_length.len();
    let ([wx, wy, wz], [sx, sy]) = (dir.map(|axis| &axis[..n]), slope.map(|axis| &axis[..n]));
    let above = &above[..n];
    for lane in 0..n {
        let closing = sx[lane] * wx[lane] + sy[lane] * wy[lane] - wz[lane];
        let to_ceiling = (part.ceiling_mm - (from_z + wz[lane] * ray_length[lane])) / -wz[lane];
        let behind = if to_ceiling < ray_length[lane] { to_ceiling } else { ray_length[lane] };
        let across = wx[lane] * wx[lane] + wy[lane] * wy[lane];
        let free = (wz[lane] < 0.0) & (closing > 0.0) & (part.curvature * across * behind < 2.0 * closing);
        let met = free & (above[lane].abs() < LAST_STEP_MM) & (ray_length[lane] > 0.0);
        ray_length[lane] = if met { ray_length[lane] } else { f64::NAN };
    }
}

/// One component of the unit normals in the camera frame.
#[inline(always)]
fn camera_normals(axis: [f64; 3], slope_x: &[f64], slope_y: &[f64], normal: &mut [f64]) {
    for ((normal, sx), sy) in normal.iter_mut().zip(slope_x).zip(slope_y) {
        *normal = (axis[2] - axis[0] * sx - axis[1] * sy) / (1.0 + sx * sx + sy * sy).sqrt();
    }
}
