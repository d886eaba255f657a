//! A part of triangles in the light of one order: the few triangles that its sheet meets, and what stands between the
//! grating and a point.
//!
//! Seen from near the source a sheet is a thin band. A grid of cells along the band knows the triangles in each; a ray
//! of light, which need not pass that viewpoint exactly, is a short line in it and is tested against the triangles of the
//! cells along that line. So the result is that of a search of all triangles, whatever the viewpoint.

use std::array::from_fn;

use multiversion::multiversion;
use nalgebra::Vector3;

use crate::part::mesh::{Mesh, Solid};
use crate::part::mesh_corners::{PlacedCorners, PlacedTriangle};
use crate::render::light::band::{Band, Corners, Patch};
use crate::render::light::ways::Ways;
use crate::render::view::block::Block;
use crate::render::view::lit_pixels::{WORD_PX, lanes};

/// Added around the bounds of a triangle, as a tangent and in mm: far more than they lose in single precision and than a
/// triangle's seams, far less than a triangle.
const BOUND_MARGIN: f64 = 1e-5;

/// Bounds of a triangle: along the band, across it, and along both diagonals. A box alone is twice as large as a triangle.
const N_BOUNDS: usize = 4;

/// Members that are compared together: as many as a vector register holds.
const STEP_MEMBERS: usize = 8;

/// The triangles in a band.
#[derive(Debug, Default)]
pub(crate) struct MeshLight {
    triangles: Vec<u32>,
    /// Where the cells of each column begin.
    columns: Vec<u32>,
    /// Where the triangles of each cell begin.
    cells: Vec<u32>,
    /// Triangles cell by cell; the cells' ends lie anywhere in them.
    members: Vec<Members>,
    /// The triangles that touch the band, and which of them each cell has.
    known: Vec<Member>,
    entries: Vec<(u32, u32)>,
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
#[derive(Debug, Clone, Copy)]
struct Members {
    low: [[f32; STEP_MEMBERS]; N_BOUNDS],
    high: [[f32; STEP_MEMBERS]; N_BOUNDS],
    nearest: [f32; STEP_MEMBERS],
    idx: [u32; STEP_MEMBERS],
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
    /// No comparison with these holds.
    const NONE: Self = Self {
        low: [[f32::NAN; STEP_MEMBERS]; N_BOUNDS],
        high: [[f32::NAN; STEP_MEMBERS]; N_BOUNDS],
        nearest: [f32::NAN; STEP_MEMBERS],
        idx: [0; STEP_MEMBERS],
    };

    #[inline]
    fn put(&mut self, place: usize, member: &Member) {
        for bound in 0..N_BOUNDS {
            self.low[bound][place] = member.low[bound];
            self.high[bound][place] = member.high[bound];
        }
        self.nearest[place] = member.nearest;
        self.idx[place] = member.idx;
    }

    /// Which of them may (1, else 0) stand in a patch before its farthest depth. All bounds are compared: that costs less
    /// than guessing which will tell.
    #[inline(always)]
    fn may_stand_before(&self, sought: &Sought) -> [u32; STEP_MEMBERS] {
        let mut may = [0; STEP_MEMBERS];
        for (may, (idx, nearest)) in may.iter_mut().zip(self.idx.iter().zip(&self.nearest)) {
            *may = u32::from(*idx != sought.idx) & u32::from(*nearest < sought.farthest);
        }
        for bound in 0..N_BOUNDS {
            let (low, high) = (&self.low[bound], &self.high[bound]);
            let (sought_low, sought_high) = (sought.low[bound], sought.high[bound]);
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
        let (from, to) = (light.cells[cell(bottom)] as usize, light.cells[cell(top) + 1] as usize);
        for members in &light.members[from / STEP_MEMBERS..to.div_ceil(STEP_MEMBERS).max(from / STEP_MEMBERS)] {
            let may = members.may_stand_before(&sought);
            if may == [0; STEP_MEMBERS] {
                continue;
            }
            let way = ways.in_part(lane);
            let mut found = members.idx.iter().zip(may).filter(|(_, may)| *may != 0);
            if found.any(|(idx, _)| solid.stands_before(*idx, &way.from, &way.way, way.limit)) {
                return Some(true);
            }
        }
    }
    Some(false)
}

impl MeshLight {
    /// Gathers the triangles of the part, carried by the stage, that touch the band, and hands out each one's corners in
    /// the camera frame, which `placed` is turned to.
    pub(crate) fn gather(
        &mut self,
        band: &Band,
        mesh: &Mesh,
        moved: &Vector3<f64>,
        placed: &mut PlacedCorners,
        mut each: impl FnMut(&PlacedTriangle, Option<&Corners>),
    ) {
        let origin = mesh.plate.point_mm + moved;
        self.triangles.clear();
        mesh.solid.gather(&mut self.triangles, |centre, radius| {
            band.touches_ball(&(origin + mesh.plate.axes * centre), radius)
        });
        self.lay_out(band);
        self.entries.clear();
        self.known.clear();
        for position in 0..self.triangles.len() {
            let idx = self.triangles[position];
            let triangle = placed.triangle(mesh, idx);
            let seen = band.corners(&triangle.corners);
            if seen.as_ref().is_some_and(|seen| !band.touches(&seen.patch)) {
                continue;
            }
            each(&triangle, seen.as_ref());
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
        let known_idx = self.known.len() as u32;
        self.known.push(Member::new(corners, idx));
        let patch = corners.map_or(&Patch::EVERYWHERE, |corners| &corners.patch);
        for column in band.columns_of(patch) {
            for cell in self.cells_of(band, column, patch.low[1], patch.high[1]) {
                self.entries.push((cell, known_idx));
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
        self.members.resize(self.entries.len().div_ceil(STEP_MEMBERS), Members::NONE);
        if let Some(last) = self.members.last_mut() {
            *last = Members::NONE;
        }
        for &(cell, known_idx) in &self.entries {
            let place = &mut self.cells[cell as usize + 1];
            let members = &mut self.members[*place as usize / STEP_MEMBERS];
            members.put(*place as usize % STEP_MEMBERS, &self.known[known_idx as usize]);
            *place += 1;
        }
    }
}
