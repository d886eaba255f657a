//! Marking of the pixels that light can reach: around the part of a triangle in the sheet, and between neighbouring
//! rays.

use optics::Camera;

use crate::part::mesh_corners::PlacedTriangle;
use crate::render::light::band::{Band, Corners};
use crate::render::view::lit_pixels::LitPixels;

/// Positions across the sheet, relative to its half-width, whose hits show where light falls.
pub(crate) const ACROSS: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// Interval of the rays traced on smooth surfaces: one in 7 pixels, between which a line is straight.
pub(crate) const COARSE: i32 = 8;

/// Margin around the area enclosed by coarse rays, pixels: the curvature of a line between them is a hundredth of it.
const COARSE_MARGIN_PX: f64 = 1.0;

/// Triangles larger than this in the image are marked in pieces.
const PIECE_PX: f64 = 16.0;

/// Greatest number of halvings of a triangle: 2¹² pieces along a side cover any image.
const MAX_PIECES_DEPTH: usize = 12;

/// End of a ray: the pixel, and whether the surface is smooth up to the next ray's end.
#[derive(Clone, Copy)]
pub(crate) struct RayEnd {
    pub pixel: [f64; 2],
    pub smooth: bool,
}

/// Ends of the rays across the sheet at one fan angle.
pub(crate) type Section = [Option<RayEnd>; ACROSS.len()];

/// Marks the pixels covered by a triangle in the band, in pieces if it is large; pieces outside the band are left out.
pub(crate) fn mark_triangle(
    camera: &Camera,
    band: &Band,
    (triangle, view_corners): (&PlacedTriangle, Option<&Corners>),
    depth: usize,
    lit: &mut LitPixels,
) {
    let (whole, bounds) = match triangle.pixels {
        [Some(a), Some(b), Some(c)] => (Some([a, b, c]), bounds(&[a, b, c])),
        pixels => (None, bounds(&pixels.into_iter().flatten().collect::<Vec<_>>())),
    };
    let Some((low, high)) = bounds else { return };
    if let Some(pixels) = whole.filter(|_| (high[0] - low[0]).max(high[1] - low[1]) <= PIECE_PX) {
        mark_in_sheet(band, view_corners, &pixels, lit);
        return;
    }
    if depth >= MAX_PIECES_DEPTH {
        lit.add_rectangle(low, high, COARSE_MARGIN_PX);
        return;
    }
    let [a, b, c] = triangle.corners;
    let (ab, bc, ca) = ((a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0);
    for piece in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
        let view_corners = band.corners(&piece);
        if view_corners.as_ref().is_none_or(|view_corners| band.touches(&view_corners.patch)) {
            mark_triangle(
                camera,
                band,
                (&PlacedTriangle::new(camera, piece), view_corners.as_ref()),
                depth + 1,
                lit,
            );
        }
    }
}

/// Marks the pixels around the part in the sheet of a triangle so small that it looks the same from anywhere.
fn mark_in_sheet(band: &Band, corners: Option<&Corners>, pixels: &[[f64; 2]; 3], lit: &mut LitPixels) {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for (side, part) in band.sides_in_sheet(corners).into_iter().enumerate() {
        let Some((from, to)) = part else { continue };
        let (a, b) = (pixels[side], pixels[(side + 1) % 3]);
        for axis in 0..2 {
            let ends = [from, to].map(|fraction| a[axis] + (b[axis] - a[axis]) * fraction);
            low[axis] = low[axis].min(ends[0].min(ends[1]));
            high[axis] = high[axis].max(ends[0].max(ends[1]));
        }
    }
    if low[0] <= high[0] {
        lit.add_rectangle(low, high, COARSE_MARGIN_PX);
    }
}

/// Marks the pixels between two sections of a smooth surface.
pub(crate) fn enclose(before: &Section, after: &Section, lit: &mut LitPixels) {
    let whole = before.iter().chain(after).all(Option::is_some);
    let strips = if whole { vec![[0, ACROSS.len() - 1]] } else { (1..ACROSS.len()).map(|k| [k - 1, k]).collect() };
    for [a, b] in strips {
        let [from, to] =
            [before, after].map(|section| [section[a], section[b]].map(|end| end.map(|end| end.pixel)));
        match (from, to) {
            ([Some(p), Some(q)], [Some(r), Some(s)]) => enclose_four([p, q], [r, s], lit),
            _ => {
                let ends: Vec<[f64; 2]> = from.into_iter().chain(to).flatten().collect();
                if let Some((low, high)) = bounds(&ends) {
                    lit.add_rectangle(low, high, COARSE_MARGIN_PX);
                }
            }
        }
    }
}

/// Marks the pixels between two pairs of ends in rectangles that exceed a slanted line by at most a pixel.
fn enclose_four(from: [[f64; 2]; 2], to: [[f64; 2]; 2], lit: &mut LitPixels) {
    let rise = |axis: usize| (to[0][axis] - from[0][axis]).abs().max((to[1][axis] - from[1][axis]).abs());
    let n = (rise(0).min(rise(1)).ceil() as usize).clamp(1, COARSE as usize);
    let at = |side: usize, step: usize| {
        let fraction = step as f64 / n as f64;
        [0, 1].map(|axis| from[side][axis] + (to[side][axis] - from[side][axis]) * fraction)
    };
    for step in 0..n {
        if let Some((low, high)) = bounds(&[at(0, step), at(1, step), at(0, step + 1), at(1, step + 1)]) {
            lit.add_rectangle(low, high, COARSE_MARGIN_PX);
        }
    }
}

fn bounds(points: &[[f64; 2]]) -> Option<([f64; 2], [f64; 2])> {
    let (first, rest) = points.split_first()?;
    Some(rest.iter().fold((*first, *first), |(low, high), p| {
        ([low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])])
    }))
}
