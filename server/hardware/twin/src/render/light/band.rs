//! The band of directions of an order's light: seen from near its source a sheet is thin.

use std::array::from_fn;

use nalgebra::{Matrix3, Vector3};
use optics::Grating;

use crate::arithmetic::floor;
use crate::part::scene::Ball;

/// Margin on either side of a band, in cells: more than the deviation of a light path from its sheet.
const BAND_SLACK_CELLS: f64 = 0.25;

/// Factor by which the band is wider than the sheet: the sheet's distance is first order (`docs/maths/twin.md`).
const BAND_FACTOR: f64 = 1.1;

/// A band of directions from a viewpoint, in columns.
#[derive(Debug)]
pub(crate) struct Band {
    pub viewpoint: Vector3<f64>,
    /// Rows: along the band, across it, forwards.
    pub axes: Matrix3<f64>,
    /// Side of a cell, a tangent.
    pub cell: f64,
    pub first_column: i64,
    /// Lowest and highest tangent across the band, by column.
    pub columns: Vec<[f64; 2]>,
}

/// A triangle as seen from the viewpoint.
pub(crate) struct Corners {
    /// Tangents along and across the band, and depth, of each corner.
    pub at: [[f64; 3]; 3],
    pub patch: Patch,
}

/// Tangents along and across a band: lowest and highest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patch {
    pub low: [f64; 2],
    pub high: [f64; 2],
}

impl Band {
    /// The band of an order's light that contains `ball`, its sheet `half_width_mm` thick to either side, sampled at
    /// fan angles `step_rad` apart; `cell` is a tangent. `None` if no light passes.
    pub(crate) fn new(
        grating: &Grating,
        order: i8,
        angles: impl Iterator<Item = f64>,
        half_width_mm: f64,
        ball: &Ball,
        cell: f64,
    ) -> Option<Self> {
        let rays: Vec<_> = angles.filter_map(|phi| grating.ray(phi, order)).collect();
        let (first, last) = (rays.first()?, rays.last()?);
        let forward = (first.direction + last.direction).normalize();
        let along = (grating.fan - forward * grating.fan.dot(&forward)).normalize();
        let axes =
            Matrix3::from_rows(&[along.transpose(), forward.cross(&along).transpose(), forward.transpose()]);
        // The nearest approach of the outermost rays.
        let between = first.origin_mm - last.origin_mm;
        let cosine = first.direction.dot(&last.direction);
        let back =
            (between.dot(&last.direction) * cosine - between.dot(&first.direction)) / (1.0 - cosine * cosine);
        let viewpoint = first.origin_mm + first.direction * back;
        let mut band = Self { viewpoint, axes, cell, first_column: 0, columns: Vec::new() };
        let mut before: Option<Vec<[f64; 2]>> = None;
        for ray in &rays {
            let across = ray.direction.cross(&grating.fan).normalize() * (half_width_mm * BAND_FACTOR);
            let middle = (ball.centre_mm - ray.origin_mm).dot(&ray.direction);
            let ends = [middle - ball.radius_mm, middle + ball.radius_mm];
            let section: Option<Vec<[f64; 2]>> = ends
                .into_iter()
                .flat_map(|along_mm| {
                    [-1.0, 1.0].map(|side| ray.origin_mm + across * side + ray.direction * along_mm)
                })
                .map(|point| band.tangents(&point))
                .collect();
            let section = section?;
            if let Some(before) = before.replace(section.clone()) {
                before.iter().zip(&section).for_each(|(a, b)| band.widen(*a, *b));
            }
        }
        (!band.columns.is_empty()).then_some(band)
    }

    /// Tangents along and across the band of a point in front of the viewpoint.
    fn tangents(&self, point: &Vector3<f64>) -> Option<[f64; 2]> {
        self.view_coordinates(point).map(|[along, across, _]| [along, across])
    }

    /// Tangents along and across the band of a point in front of the viewpoint, and its depth.
    #[inline]
    fn view_coordinates(&self, point: &Vector3<f64>) -> Option<[f64; 3]> {
        let at = self.axes * (point - self.viewpoint);
        (at.z > 0.0).then(|| [at.x / at.z, at.y / at.z, at.z])
    }

    fn slack(&self) -> f64 {
        self.cell * BAND_SLACK_CELLS
    }

    /// Lowest and highest tangents of the sheet itself across the columns covered by a patch.
    fn sheet_across(&self, patch: &Patch) -> [f64; 2] {
        let columns = &self.columns[self.columns_of(patch)];
        let low = columns.iter().fold(f64::INFINITY, |low, column| low.min(column[0] + self.slack()));
        let high = columns.iter().fold(f64::NEG_INFINITY, |high, column| high.max(column[1] - self.slack()));
        [low, high]
    }

    /// The part (from, to) of each side of a triangle, from corner to next corner, that lies in the sheet; all of it,
    /// if a corner lies behind the viewpoint.
    pub(crate) fn sides_in_sheet(&self, corners: Option<&Corners>) -> [Option<(f64, f64)>; 3] {
        let Some(Corners { at, patch }) = corners else { return [Some((0.0, 1.0)); 3] };
        let [low, high] = self.sheet_across(patch);
        // Signed distances from the planes through the viewpoint that bound it: linear along a side.
        let above = at.map(|[_, across, depth]| (across - low) * depth);
        let below = at.map(|[_, across, depth]| (high - across) * depth);
        [(0, 1), (1, 2), (2, 0)].map(|(i, j)| {
            let (a, b) = (not_negative(above[i], above[j])?, not_negative(below[i], below[j])?);
            let (from, to) = (a.0.max(b.0), a.1.min(b.1));
            (from <= to).then_some((from, to))
        })
    }

    fn column(&self, along: f64) -> i64 {
        floor(along / self.cell) as i64
    }

    /// Extends the columns around two directions by the range between them.
    fn widen(&mut self, a: [f64; 2], b: [f64; 2]) {
        let (from, to) = (self.column(a[0].min(b[0])) - 1, self.column(a[0].max(b[0])) + 1);
        const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
        if self.columns.is_empty() {
            self.first_column = from;
        }
        if from < self.first_column {
            let more = (self.first_column - from) as usize;
            self.columns.splice(0..0, std::iter::repeat_n(NOTHING, more));
            self.first_column = from;
        }
        let needed = (to - self.first_column + 1) as usize;
        if self.columns.len() < needed {
            self.columns.resize(needed, NOTHING);
        }
        let slack = self.slack();
        for column in &mut self.columns[(from - self.first_column) as usize..needed] {
            column[0] = column[0].min(a[1].min(b[1]) - slack);
            column[1] = column[1].max(a[1].max(b[1]) + slack);
        }
    }

    /// Columns of the band covered by a patch.
    pub(crate) fn columns_of(&self, patch: &Patch) -> std::ops::Range<usize> {
        let last = self.columns.len() as i64;
        let from = self.column(patch.low[0]).saturating_sub(self.first_column).clamp(0, last);
        let to = self.column(patch.high[0]).saturating_sub(self.first_column).saturating_add(1).clamp(0, last);
        from as usize..to.max(from) as usize
    }

    /// Whether a patch of directions touches the band.
    pub(crate) fn touches(&self, patch: &Patch) -> bool {
        let columns = &self.columns[self.columns_of(patch)];
        columns.iter().any(|column| patch.low[1] <= column[1] && patch.high[1] >= column[0])
    }

    /// The directions of a triangle; `None` if a corner lies behind the viewpoint.
    pub(crate) fn corners(&self, corners: &[Vector3<f64>; 3]) -> Option<Corners> {
        let [a, b, c] = corners;
        let (a, b, c) = (self.view_coordinates(a)?, self.view_coordinates(b)?, self.view_coordinates(c)?);
        let low = [0, 1].map(|axis: usize| a[axis].min(b[axis]).min(c[axis]));
        let high = [0, 1].map(|axis: usize| a[axis].max(b[axis]).max(c[axis]));
        Some(Corners { at: [a, b, c], patch: Patch { low, high } })
    }

    /// Whether a sphere may touch the band.
    pub(crate) fn touches_ball(&self, centre: &Vector3<f64>, radius_mm: f64) -> bool {
        let at = self.axes * (centre - self.viewpoint);
        let nearest = at.z - radius_mm;
        if nearest <= 0.0 {
            return true;
        }
        let middle = [at.x / at.z, at.y / at.z];
        // At d from the centre, x/z changes by (d_x − (x/z)·d_z)/z.
        let half = middle.map(|tangent| radius_mm * (1.0 + tangent * tangent).sqrt() / nearest);
        let (low, high) = (from_fn(|axis| middle[axis] - half[axis]), from_fn(|axis| middle[axis] + half[axis]));
        self.touches(&Patch { low, high })
    }
}

/// The interval within 0–1 in which the linear function from `a` at 0 to `b` at 1 is not negative.
fn not_negative(a: f64, b: f64) -> Option<(f64, f64)> {
    match (a >= 0.0, b >= 0.0) {
        (true, true) => Some((0.0, 1.0)),
        (true, false) => Some((0.0, a / (a - b))),
        (false, true) => Some((a / (a - b), 1.0)),
        (false, false) => None,
    }
}
