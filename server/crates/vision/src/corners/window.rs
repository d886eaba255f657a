//! Which pixels a corner fit sees: a parallelogram along the board's own directions.

use crate::GreyImage;

use super::fit::Window;
use super::model::{Cross, CrossShape};
use super::params::{EDGE_BAND_MIN_PX, EDGE_BAND_SIGMAS, WINDOW_MIN_PX};

/// Size of a window: a share of the neighbour distance, limited in pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    /// Half-side as a share of the neighbour distance.
    pub squares: f64,
    /// Largest half-side (px).
    pub max_px: f64,
}

/// The window around `centre_px`, `square_px` being the steps to the next column and to the next row.
///
/// With `edges`, pixels far from both edges are left out; with `None` the whole parallelogram is used.
pub(super) fn window_around(
    image: &GreyImage,
    centre_px: [f64; 2],
    square_px: [[f64; 2]; 2],
    reach: Reach,
    edges: Option<&CrossShape>,
) -> Window {
    let steps = square_px.map(|s| s[0].hypot(s[1]));
    let half_sides = steps.map(|s| (reach.squares * s).min(reach.max_px).max(WINDOW_MIN_PX));
    let share = [half_sides[0] / steps[0], half_sides[1] / steps[1]];
    let centre = centre_px.map(f64::round);
    let [c, r] = square_px;
    let extent = [0, 1].map(|k| (share[0] * c[k]).abs() + (share[1] * r[k]).abs());
    let determinant = c[0] * r[1] - c[1] * r[0];
    let band = edges.map(|shape| (Cross::new(shape), EDGE_BAND_SIGMAS * shape.blur_px + EDGE_BAND_MIN_PX));
    let mut window = Window { centre, half_side_px: half_sides[0].max(half_sides[1]), pixels: Vec::new() };
    for v in pixel_range(centre_px[1], extent[1], image.height()) {
        for u in pixel_range(centre_px[0], extent[0], image.width()) {
            let q = [u as f64 - centre_px[0], v as f64 - centre_px[1]];
            let along_column = (q[0] * r[1] - q[1] * r[0]) / determinant;
            let along_row = (c[0] * q[1] - c[1] * q[0]) / determinant;
            let inside = along_column.abs() <= share[0] && along_row.abs() <= share[1];
            let near_edge = band.as_ref().is_none_or(|(cross, width)| {
                cross.edge_coordinates(q).iter().any(|(distance, _)| distance.abs() <= *width)
            });
            if inside && near_edge {
                window.pixels.push([u as f64 - centre[0], v as f64 - centre[1], f64::from(image.at(u, v))]);
            }
        }
    }
    window
}

fn pixel_range(centre: f64, extent: f64, side: usize) -> std::ops::Range<usize> {
    let first = (centre - extent).ceil().clamp(0.0, side as f64);
    let last = (centre + extent).floor().clamp(-1.0, side as f64 - 1.0);
    first as usize..(last + 1.0) as usize
}
