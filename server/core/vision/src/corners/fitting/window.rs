//! The pixels used by a corner fit: a parallelogram along the board's own directions.

use multiversion::multiversion;

use crate::{GreyImage, Pixels};

use super::fit::Window;
use super::model::CrossShape;
use crate::corners::params::{EDGE_BAND_MIN_PX, EDGE_BAND_SIGMAS, WINDOW_MIN_PX};

/// Size of a window: a fraction of the neighbour distance, limited in pixels.
#[derive(Debug, Clone, Copy)]
pub struct Reach {
    /// Half-side as a fraction of the neighbour distance.
    pub squares: f64,
    /// Largest half-side (px).
    pub max_px: f64,
}

/// The window around `centre_px`; `square_px` holds the steps to the next column and to the next row.
///
/// With `edges`, pixels far from both edges are left out; with `None` the whole parallelogram is used.
pub fn window_around(
    image: &GreyImage,
    centre_px: [f64; 2],
    square_px: [[f64; 2]; 2],
    reach: Reach,
    edges: Option<&CrossShape>,
) -> Window {
    match image.pixels() {
        Pixels::Eight(levels) => collected(image, levels, centre_px, square_px, reach, edges),
        Pixels::Sixteen(levels) => collected(image, levels, centre_px, square_px, reach, edges),
    }
}

fn collected<T: Copy + Into<f32>>(
    image: &GreyImage,
    levels: &[T],
    centre_px: [f64; 2],
    square_px: [[f64; 2]; 2],
    reach: Reach,
    edges: Option<&CrossShape>,
) -> Window {
    let steps = square_px.map(|s| s[0].hypot(s[1]));
    let half_sides = half_sides(square_px, reach);
    let share = [half_sides[0] / steps[0], half_sides[1] / steps[1]];
    let centre = centre_px.map(f64::round);
    let offset = [0, 1].map(|k| (centre[k] - centre_px[k]) as f32);
    let band = edges.map(Band::new);
    let mut window =
        Window::new(centre, half_sides[0].max(half_sides[1]), (4.2 * half_sides[0] * half_sides[1]) as usize);
    let mut near = Vec::new();
    let extent = share[0] * square_px[0][1].abs() + share[1] * square_px[1][1].abs();
    for v in pixel_range(centre_px[1], extent, image.height()) {
        let (from, to) = span(v as f64 - centre_px[1], square_px, share);
        let row = &levels[v * image.width()..][..image.width()];
        let y = (v as f64 - centre[1]) as f32;
        let columns = pixel_range(centre_px[0] + 0.5 * (from + to), 0.5 * (to - from), image.width());
        let x = (columns.start as f64 - centre[0]) as f32;
        let levels = row.get(columns).unwrap_or_default();
        let Some(band) = &band else {
            window.push_run(x, y, levels);
            continue;
        };
        near.resize(levels.len(), false);
        mark_near(band, x + offset[0], y + offset[1], &mut near);
        let mut passed = 0;
        for run in near.chunk_by(|a, b| a == b) {
            if run[0] {
                window.push_run(x + passed as f32, y, &levels[passed..passed + run.len()]);
            }
            passed += run.len();
        }
    }
    window.padded()
}

/// Half-sides of a window along the columns and along the rows (px).
pub fn half_sides(square_px: [[f64; 2]; 2], reach: Reach) -> [f64; 2] {
    square_px.map(|s| (reach.squares * s[0].hypot(s[1])).min(reach.max_px).max(WINDOW_MIN_PX))
}

/// Offsets from the centre, along u, at which the parallelogram |α| ≤ `share[0]`, |β| ≤ `share[1]` (α columns and β
/// rows away) begins and ends on the pixel row `qv` below the centre; the end is less than the beginning if the row
/// misses it.
fn span(qv: f64, [c, r]: [[f64; 2]; 2], share: [f64; 2]) -> (f64, f64) {
    let determinant = (c[0] * r[1] - c[1] * r[0]).abs();
    let between = |side: [f64; 2], share: f64| {
        // |q × side| ≤ share · |c × r|: between two lines along `side`.
        let half = share * determinant / side[1].abs();
        let middle = qv * side[0] / side[1];
        if side[1] == 0.0 { (f64::NEG_INFINITY, f64::INFINITY) } else { (middle - half, middle + half) }
    };
    let ((a0, a1), (b0, b1)) = (between(r, share[0]), between(c, share[1]));
    (a0.max(b0), a1.min(b1))
}

/// Bands along both edges.
struct Band {
    normal: [[f32; 2]; 2],
    half_curvature: [f32; 2],
    half_width: f32,
}

impl Band {
    fn new(shape: &CrossShape) -> Self {
        Self {
            normal: shape.normal_rad.map(|angle| [angle.cos() as f32, angle.sin() as f32]),
            half_curvature: shape.curvature_per_px.map(|c| 0.5 * c as f32),
            half_width: (EDGE_BAND_SIGMAS * shape.blur_px + EDGE_BAND_MIN_PX) as f32,
        }
    }

    /// Whether the point `q` (px from the crossing) is near one of the edges.
    #[inline(always)]
    fn holds(&self, q: [f32; 2]) -> bool {
        let distance = |k: usize| {
            let n = self.normal[k];
            let along = n[0] * q[1] - n[1] * q[0];
            n[0] * q[0] + n[1] * q[1] - self.half_curvature[k] * along * along
        };
        (distance(0).abs() <= self.half_width) | (distance(1).abs() <= self.half_width)
    }
}

/// Which pixels of a row are near an edge; the first is at (`x`, `y`) px from the crossing.
#[multiversion(targets("x86_64+avx2"))]
fn mark_near(band: &Band, x: f32, y: f32, near: &mut [bool]) {
    for (k, near) in near.iter_mut().enumerate() {
        *near = band.holds([x + k as i32 as f32, y]);
    }
}

fn pixel_range(centre: f64, extent: f64, side: usize) -> std::ops::Range<usize> {
    let first = (centre - extent).ceil().clamp(0.0, side as f64);
    let last = (centre + extent).floor().clamp(-1.0, side as f64 - 1.0);
    first as usize..(last + 1.0) as usize
}
