//! A part of triangles in the light of one order: the few triangles that its sheet meets, and what stands between the
//! grating and a point.
//!
//! Seen from near the source a sheet is a thin band. A grid of cells along the band knows the triangles in each; a ray
//! of light, which need not pass that viewpoint exactly, is a short line in it and is tested against the triangles of the
//! cells along that line. So the result is that of a search of all triangles, whatever the viewpoint.

use std::array::from_fn;

use multiversion::multiversion;
use nalgebra::{Matrix3, Vector3};
use optics::Grating;

use crate::block::{Block, floor};
use crate::lit_pixels::{WORD_PX, lanes};
use crate::mesh::{Mesh, Solid};
use crate::scene::Ball;
use crate::ways::Ways;

/// Added around the bounds of a triangle, as a tangent and in mm: far more than they lose in single precision and than a
/// triangle's seams, far less than a triangle.
const BOUND_MARGIN: f64 = 1e-5;

/// Bounds of a triangle: along the band, across it, and along both diagonals. A box alone is twice as large as a triangle.
const N_BOUNDS: usize = 4;

/// Members that are compared together: as many as a vector register holds.
const STEP_MEMBERS: usize = 8;

/// Added to either side of a band, in cells: more than a way of light strays from its sheet.
const BAND_SLACK_CELLS: f64 = 0.25;

/// Share by which the band is wider than the sheet: the sheet's distance is first order (`docs/maths/twin.md`).
const BAND_SHARE: f64 = 1.1;

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
    columns: Vec<[f64; 2]>,
}

/// The triangles in a band.
#[derive(Debug, Default)]
pub(crate) struct MeshLight {
    triangles: Vec<u32>,
    /// Where the cells of each column begin.
    columns: Vec<u32>,
    /// Where the triangles of each cell begin.
    cells: Vec<u32>,
    /// Triangles cell by cell.
    members: Members,
    entries: Vec<(u32, Member)>,
}

/// A triangle as seen from the viewpoint.
pub(crate) struct Corners {
    /// Tangents along and across the band, and depth, of each.
    at: [[f64; 3]; 3],
    pub patch: Patch,
}

/// A triangle of a cell and what it takes up as seen from the viewpoint: most are ruled out by that alone.
#[derive(Debug, Clone, Copy, Default)]
struct Member {
    low: [f32; N_BOUNDS],
    high: [f32; N_BOUNDS],
    /// Depth of its nearest corner, mm.
    nearest: f32,
    idx: u32,
}

/// What may stand in a way: what takes up some of these tangents before this depth, and is not this triangle.
struct Sought {
    low: [f32; N_BOUNDS],
    high: [f32; N_BOUNDS],
    farthest: f32,
    idx: u32,
}

/// A direction along the bounds of a member.
#[inline]
fn in_bounds(along: f64, across: f64) -> [f64; N_BOUNDS] {
    [along, across, along + across, along - across]
}

/// Members by field, so that many are compared at once.
#[derive(Debug, Default)]
struct Members {
    low: [Vec<f32>; N_BOUNDS],
    high: [Vec<f32>; N_BOUNDS],
    nearest: Vec<f32>,
    idx: Vec<u32>,
}

/// Tangents along and across a band: lowest and highest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patch {
    low: [f64; 2],
    high: [f64; 2],
    /// Least and greatest depth from the viewpoint, mm.
    depth_mm: [f64; 2],
}

impl Band {
    /// The band of an order's light on what `ball` holds, its sheet `reach_mm` thick to either side, sampled at fan angles
    /// `step_rad` apart; `cell` is a tangent. `None` if no light passes.
    pub(crate) fn new(
        grating: &Grating,
        order: i8,
        angles: impl Iterator<Item = f64>,
        reach_mm: f64,
        ball: &Ball,
        cell: f64,
    ) -> Option<Self> {
        let rays: Vec<_> = angles.filter_map(|phi| grating.ray(phi, order)).collect();
        let (first, last) = (rays.first()?, rays.last()?);
        let forward = (first.direction + last.direction).normalize();
        let along = (grating.fan - forward * grating.fan.dot(&forward)).normalize();
        let axes =
            Matrix3::from_rows(&[along.transpose(), forward.cross(&along).transpose(), forward.transpose()]);
        // Where the outermost rays come nearest to each other.
        let between = first.origin_mm - last.origin_mm;
        let cosine = first.direction.dot(&last.direction);
        let back =
            (between.dot(&last.direction) * cosine - between.dot(&first.direction)) / (1.0 - cosine * cosine);
        let viewpoint = first.origin_mm + first.direction * back;
        let mut band = Self { viewpoint, axes, cell, first_column: 0, columns: Vec::new() };
        let mut before: Option<Vec<[f64; 2]>> = None;
        for ray in &rays {
            let across = ray.direction.cross(&grating.fan).normalize() * (reach_mm * BAND_SHARE);
            let middle = (ball.centre_mm - ray.origin_mm).dot(&ray.direction);
            let ends = [middle - ball.radius_mm, middle + ball.radius_mm];
            let section: Option<Vec<[f64; 2]>> = ends
                .into_iter()
                .flat_map(|reach| [-1.0, 1.0].map(|side| ray.origin_mm + across * side + ray.direction * reach))
                .map(|point| band.tangents(&point))
                .collect();
            let section = section?;
            if let Some(before) = before.replace(section.clone()) {
                before.iter().zip(&section).for_each(|(a, b)| band.widen(*a, *b));
            }
        }
        (!band.columns.is_empty()).then_some(band)
    }

    /// Tangents along and across the band of a point before the viewpoint.
    fn tangents(&self, point: &Vector3<f64>) -> Option<[f64; 2]> {
        self.seen(point).map(|[along, across, _]| [along, across])
    }

    /// Tangents along and across the band of a point before the viewpoint, and its depth.
    #[inline]
    fn seen(&self, point: &Vector3<f64>) -> Option<[f64; 3]> {
        let at = self.axes * (point - self.viewpoint);
        (at.z > 0.0).then(|| [at.x / at.z, at.y / at.z, at.z])
    }

    fn slack(&self) -> f64 {
        self.cell * BAND_SLACK_CELLS
    }

    /// Lowest and highest tangents of the sheet itself across the columns that a patch reaches over.
    fn sheet_across(&self, patch: &Patch) -> [f64; 2] {
        let columns = &self.columns[self.columns_of(patch)];
        let low = columns.iter().fold(f64::INFINITY, |low, column| low.min(column[0] + self.slack()));
        let high = columns.iter().fold(f64::NEG_INFINITY, |high, column| high.max(column[1] - self.slack()));
        [low, high]
    }

    /// Which part (from, to) of each side of a triangle, from corner to next corner, lies in the sheet; all of it, if a
    /// corner lies behind the viewpoint.
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

    /// Adds what lies between two directions to the columns around them.
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

    /// Columns of the band that a patch reaches over.
    fn columns_of(&self, patch: &Patch) -> std::ops::Range<usize> {
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
        let (a, b, c) = (self.seen(a)?, self.seen(b)?, self.seen(c)?);
        let low = [0, 1, 2].map(|axis: usize| a[axis].min(b[axis]).min(c[axis]));
        let high = [0, 1, 2].map(|axis: usize| a[axis].max(b[axis]).max(c[axis]));
        let patch = Patch { low: [low[0], low[1]], high: [high[0], high[1]], depth_mm: [low[2], high[2]] };
        Some(Corners { at: [a, b, c], patch })
    }

    /// Whether a ball may touch the band.
    fn touches_ball(&self, centre: &Vector3<f64>, radius_mm: f64) -> bool {
        let at = self.axes * (centre - self.viewpoint);
        let nearest = at.z - radius_mm;
        if nearest <= 0.0 {
            return true;
        }
        let middle = [at.x / at.z, at.y / at.z];
        // By d from the centre, x/z changes by (d_x − (x/z)·d_z)/z.
        let half = middle.map(|tangent| radius_mm * (1.0 + tangent * tangent).sqrt() / nearest);
        let (low, high) = (from_fn(|axis| middle[axis] - half[axis]), from_fn(|axis| middle[axis] + half[axis]));
        self.touches(&Patch { low, high, depth_mm: [nearest, at.z + radius_mm] })
    }
}

/// The part of 0–1 over which what is `a` at 0 and `b` at 1, and linear between, is not negative.
fn not_negative(a: f64, b: f64) -> Option<(f64, f64)> {
    match (a >= 0.0, b >= 0.0) {
        (true, true) => Some((0.0, 1.0)),
        (true, false) => Some((0.0, a / (a - b))),
        (false, true) => Some((a / (a - b), 1.0)),
        (false, false) => None,
    }
}

impl Patch {
    /// All directions.
    const EVERYWHERE: Self =
        Self { low: [f64::NEG_INFINITY; 2], high: [f64::INFINITY; 2], depth_mm: [0.0, f64::INFINITY] };
}

impl Member {
    /// A triangle; where it is not known, it may be anywhere.
    fn new(corners: Option<&Corners>, idx: u32) -> Self {
        let Some(Corners { at, patch }) = corners else {
            let (low, high) = ([f32::NEG_INFINITY; N_BOUNDS], [f32::INFINITY; N_BOUNDS]);
            return Self { low, high, nearest: 0.0, idx };
        };
        let [a, b, c] = at.map(|[along, across, _]| in_bounds(along, across));
        Self {
            low: from_fn(|k| (a[k].min(b[k]).min(c[k]) - BOUND_MARGIN) as f32),
            high: from_fn(|k| (a[k].max(b[k]).max(c[k]) + BOUND_MARGIN) as f32),
            nearest: (patch.depth_mm[0] - BOUND_MARGIN * patch.depth_mm[0]) as f32,
            idx,
        }
    }
}

impl Members {
    /// Room for `n` members, and for a step beyond them that holds none.
    fn make_room(&mut self, n: usize) {
        let Self { low, high, nearest, idx } = self;
        for bounds in low.iter_mut().chain(high).chain([nearest]) {
            bounds.clear();
            bounds.resize(n + STEP_MEMBERS, f32::NAN);
        }
        idx.clear();
        idx.resize(n + STEP_MEMBERS, 0);
    }

    fn put(&mut self, place: usize, member: &Member) {
        for axis in 0..N_BOUNDS {
            self.low[axis][place] = member.low[axis];
            self.high[axis][place] = member.high[axis];
        }
        self.nearest[place] = member.nearest;
        self.idx[place] = member.idx;
    }

    /// Which members of a step from `first` may (1, else 0) stand in a patch before its farthest depth. All bounds are compared: that
    /// costs less than guessing which will tell.
    #[inline(always)]
    fn may_stand_before(&self, first: usize, sought: &Sought) -> [u32; STEP_MEMBERS] {
        let step = |bounds: &[f32]| -> [f32; STEP_MEMBERS] { from_fn(|k| bounds[first..][..STEP_MEMBERS][k]) };
        let (nearest, idx) = (step(&self.nearest), &self.idx[first..][..STEP_MEMBERS]);
        let mut may = [0; STEP_MEMBERS];
        for k in 0..STEP_MEMBERS {
            may[k] = u32::from(idx[k] != sought.idx) & u32::from(nearest[k] < sought.farthest);
        }
        for axis in 0..N_BOUNDS {
            let (low, high) = (step(&self.low[axis]), step(&self.high[axis]));
            let (sought_low, sought_high) = (sought.low[axis], sought.high[axis]);
            for k in 0..STEP_MEMBERS {
                may[k] &= u32::from(low[k] <= sought_high) & u32::from(high[k] >= sought_low);
            }
        }
        may
    }
}

/// Which of the ways `bits` are blocked by another triangle than the one at their end, which they meet there and nowhere
/// before; and which it cannot tell, because they do not lie in the band.
#[multiversion(targets("x86_64+avx2"))]
pub(crate) fn blocked_ways(
    light: &MeshLight,
    band: &Band,
    solid: &Solid,
    ways: &Ways,
    triangle: &[u32; WORD_PX],
    bits: u64,
) -> (u64, u64) {
    let (mut blocked, mut unknown) = (0, 0);
    for lane in lanes(bits) {
        match is_blocked(light, band, solid, ways, lane, triangle[lane]) {
            Some(is_blocked) => blocked |= u64::from(is_blocked) << lane,
            None => unknown |= 1 << lane,
        }
    }
    (blocked, unknown)
}

/// One way of [`blocked_ways`].
#[inline(always)]
fn is_blocked(
    light: &MeshLight,
    band: &Band,
    solid: &Solid,
    ways: &Ways,
    lane: usize,
    triangle: u32,
) -> Option<bool> {
    let at = |pair: &[Block; 2]| [pair[0][lane], pair[1][lane]];
    let ([left, right], [bottom, top], [first, last]) = (at(&ways.along), at(&ways.across), at(&ways.columns));
    if !(ways.before[lane] && first >= 0.0 && last < band.columns.len() as f64) {
        return None;
    }
    let sought = Sought {
        low: [left, bottom, left + bottom, left - top].map(|x| x as f32),
        high: [right, top, right + top, right - bottom].map(|x| x as f32),
        farthest: ways.farthest[lane] as f32,
        idx: triangle,
    };
    for column in first as usize..=last as usize {
        let [low, high] = band.columns[column];
        if bottom < low || top > high {
            return None;
        }
        let cell = |across: f64| light.columns[column] as usize + ((across - low) / band.cell) as usize;
        let members = light.cells[cell(bottom)]..light.cells[cell(top) + 1];
        for first in (members.start as usize..members.end as usize).step_by(STEP_MEMBERS) {
            let may = light.members.may_stand_before(first, &sought);
            if may == [0; STEP_MEMBERS] {
                continue;
            }
            let (way, idx) = (ways.in_part(lane), &light.members.idx[first..][..STEP_MEMBERS]);
            let mut found = idx.iter().zip(may).filter(|(_, may)| *may != 0);
            if found.any(|(idx, _)| solid.stands_before(*idx, &way.from, &way.way, way.limit)) {
                return Some(true);
            }
        }
    }
    Some(false)
}

impl MeshLight {
    /// Gathers the triangles of the part, carried by the stage, that touch the band, and hands out each one's corners in
    /// the camera frame.
    pub(crate) fn gather(
        &mut self,
        band: &Band,
        mesh: &Mesh,
        moved: &Vector3<f64>,
        mut each: impl FnMut(&[Vector3<f64>; 3], Option<&Corners>),
    ) {
        let origin = mesh.plate.point_mm + moved;
        self.triangles.clear();
        mesh.solid.gather(&mut self.triangles, |centre, radius| {
            band.touches_ball(&(origin + mesh.plate.axes * centre), radius)
        });
        self.lay_out(band);
        self.entries.clear();
        for position in 0..self.triangles.len() {
            let idx = self.triangles[position];
            let corners = mesh.solid.corners(idx).map(|corner| origin + mesh.plate.axes * corner);
            let seen = band.corners(&corners);
            if seen.as_ref().is_some_and(|seen| !band.touches(&seen.patch)) {
                continue;
            }
            each(&corners, seen.as_ref());
            self.enter(band, seen.as_ref(), idx);
        }
        self.sort();
    }

    /// Numbers the cells: column by column, as many as the band is wide there.
    fn lay_out(&mut self, band: &Band) {
        self.columns.clear();
        let mut n_cells = 0;
        for [low, high] in &band.columns {
            self.columns.push(n_cells);
            n_cells += ((high - low) / band.cell).ceil().max(0.0) as u32 + 1;
        }
        self.columns.push(n_cells);
    }

    /// Cells of a column between two tangents across the band.
    fn cells_of(&self, band: &Band, column: usize, low: f64, high: f64) -> std::ops::Range<u32> {
        let (first, end) = (self.columns[column], self.columns[column + 1]);
        let from = ((low - band.columns[column][0]) / band.cell).clamp(0.0, f64::from(end - first));
        let to = ((high - band.columns[column][0]) / band.cell + 1.0).clamp(0.0, f64::from(end - first));
        first + from as u32..first + to as u32
    }

    fn enter(&mut self, band: &Band, corners: Option<&Corners>, idx: u32) {
        let member = Member::new(corners, idx);
        let patch = corners.map_or(&Patch::EVERYWHERE, |corners| &corners.patch);
        for column in band.columns_of(patch) {
            for cell in self.cells_of(band, column, patch.low[1], patch.high[1]) {
                self.entries.push((cell, member));
            }
        }
    }

    /// Sorts the entries by cell (by counting).
    fn sort(&mut self) {
        let n_cells = self.columns.last().map_or(0, |&end| end as usize);
        self.cells.clear();
        self.cells.resize(n_cells + 2, 0);
        for &(cell, _) in &self.entries {
            self.cells[cell as usize + 2] += 1;
        }
        for idx in 2..self.cells.len() {
            self.cells[idx] += self.cells[idx - 1];
        }
        self.members.make_room(self.entries.len());
        for (cell, member) in &self.entries {
            let place = &mut self.cells[*cell as usize + 1];
            self.members.put(*place as usize, member);
            *place += 1;
        }
    }
}
