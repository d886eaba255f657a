//! A part of triangles in the light of one order: the few triangles that its sheet meets, and what stands between the
//! grating and a point.
//!
//! Seen from near the source a sheet is a thin band. A grid of cells along the band knows the triangles in each; a ray
//! of light, which need not pass that viewpoint exactly, is a short line in it and is tested against the triangles of the
//! cells along that line. So the result is that of a search of all triangles, whatever the viewpoint.

use multiversion::multiversion;
use nalgebra::{Matrix3, Vector3};
use optics::Grating;

use crate::block::{Block, NOTHING, floor};
use crate::lit_pixels::WORD_PX;
use crate::mesh::Mesh;
use crate::params::SAME_HIT_MM;
use crate::scene::Ball;

/// Added around the bounds of a triangle, as a tangent and in mm: far more than they lose in single precision and than a
/// triangle's seams, far less than a triangle.
const BOUND_MARGIN: f64 = 1e-5;

/// Share by which the band is wider than the sheet: the sheet's distance is first order (`docs/maths/twin.md`).
const BAND_SHARE: f64 = 1.1;

/// A band of directions from a viewpoint, in columns.
#[derive(Debug)]
pub(crate) struct Band {
    viewpoint: Vector3<f64>,
    /// Rows: along the band, across it, forwards.
    axes: Matrix3<f64>,
    cell: f64,
    first_column: i64,
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
    members: Vec<Member>,
    entries: Vec<(u32, Member)>,
}

/// A triangle of a cell and what it takes up as seen from the viewpoint: most are ruled out by that alone.
#[derive(Debug, Clone, Copy, Default)]
struct Member {
    low: [f32; 2],
    high: [f32; 2],
    /// Depth of its nearest corner, mm.
    nearest: f32,
    idx: u32,
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
        angles: impl Iterator<Item = f64> + Clone,
        reach_mm: f64,
        ball: &Ball,
        cell: f64,
    ) -> Option<Self> {
        let rays = || angles.clone().filter_map(|phi| grating.ray(phi, order));
        let (first, last) = (rays().next()?, rays().last()?);
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
        for ray in rays() {
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

    fn column(&self, along: f64) -> i64 {
        floor(along / self.cell) as i64
    }

    /// Adds what lies between two directions to the columns around them, with a cell to spare.
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
        for column in &mut self.columns[(from - self.first_column) as usize..needed] {
            column[0] = column[0].min(a[1].min(b[1]) - self.cell);
            column[1] = column[1].max(a[1].max(b[1]) + self.cell);
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
    pub(crate) fn patch(&self, corners: &[Vector3<f64>; 3]) -> Option<Patch> {
        let [a, b, c] = corners.each_ref().map(|corner| self.seen(corner));
        let (a, b, c) = (a?, b?, c?);
        let low = [0, 1, 2].map(|axis: usize| a[axis].min(b[axis]).min(c[axis]));
        let high = [0, 1, 2].map(|axis: usize| a[axis].max(b[axis]).max(c[axis]));
        Some(Patch { low: [low[0], low[1]], high: [high[0], high[1]], depth_mm: [low[2], high[2]] })
    }

    /// Whether a ball may touch the band.
    fn touches_ball(&self, centre: &Vector3<f64>, radius_mm: f64) -> bool {
        let at = self.axes * (centre - self.viewpoint);
        let nearest = at.z - radius_mm;
        if nearest <= 0.0 {
            return true;
        }
        let middle = [at.x / at.z, at.y / at.z];
        let half = radius_mm * (1.0 + middle[0].abs().max(middle[1].abs())) / nearest;
        let depth_mm = [nearest, at.z + radius_mm];
        self.touches(&Patch { low: middle.map(|x| x - half), high: middle.map(|x| x + half), depth_mm })
    }
}

impl Patch {
    /// All directions.
    const EVERYWHERE: Self =
        Self { low: [f64::NEG_INFINITY; 2], high: [f64::INFINITY; 2], depth_mm: [0.0, f64::INFINITY] };
}

impl Member {
    fn new(patch: &Patch, idx: u32) -> Self {
        Self {
            low: patch.low.map(|low| (low - BOUND_MARGIN) as f32),
            high: patch.high.map(|high| (high + BOUND_MARGIN) as f32),
            nearest: (patch.depth_mm[0] - BOUND_MARGIN * patch.depth_mm[0]) as f32,
            idx,
        }
    }

    /// What [`Self::may_stand_before`] compares with: a patch down to its farthest depth, and a triangle that does not count.
    fn sought(patch: &Patch, idx: u32) -> Self {
        let [low, high] = [patch.low, patch.high].map(|corner| corner.map(|tangent| tangent as f32));
        Self { low, high, nearest: patch.depth_mm[1] as f32, idx }
    }

    /// Whether it may stand in a patch before its farthest depth. All bounds are compared: that costs less than guessing
    /// which will tell.
    #[inline]
    fn may_stand_before(&self, sought: &Self) -> bool {
        (self.idx != sought.idx)
            & (self.nearest < sought.nearest)
            & (self.low[0] <= sought.high[0])
            & (self.high[0] >= sought.low[0])
            & (self.low[1] <= sought.high[1])
            & (self.high[1] >= sought.low[1])
    }
}

impl MeshLight {
    /// Gathers the triangles of the part, carried by the stage, that touch the band, and hands out each one's corners in
    /// the camera frame.
    pub(crate) fn gather(
        &mut self,
        band: &Band,
        mesh: &Mesh,
        moved: &Vector3<f64>,
        mut each: impl FnMut(&[Vector3<f64>; 3]),
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
            let patch = band.patch(&corners);
            if patch.is_some_and(|patch| !band.touches(&patch)) {
                continue;
            }
            each(&corners);
            self.enter(band, &patch.unwrap_or(Patch::EVERYWHERE), idx);
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

    fn enter(&mut self, band: &Band, patch: &Patch, idx: u32) {
        let member = Member::new(patch, idx);
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
        self.members.clear();
        self.members.resize(self.entries.len(), Member::default());
        for &(cell, member) in &self.entries {
            let place = &mut self.cells[cell as usize + 1];
            self.members[*place as usize] = member;
            *place += 1;
        }
    }

    /// Whether another triangle stands in a way than the one at its end, which it meets there and nowhere before; `None`
    /// if it does not lie in the band.
    pub(crate) fn is_in_the_way(
        &self,
        band: &Band,
        mesh: &Mesh,
        moved: &Vector3<f64>,
        way: &Way<'_>,
    ) -> Option<bool> {
        let patch = way.ways.patch(way.lane)?;
        let columns = band.columns_of(&patch);
        if columns.len() as i64 != band.column(patch.high[0]) - band.column(patch.low[0]) + 1 {
            return None;
        }
        let sought = Member::sought(&patch, way.triangle);
        for column in columns {
            let [low, high] = band.columns[column];
            if patch.low[1] < low || patch.high[1] > high {
                return None;
            }
            let cells = self.cells_of(band, column, patch.low[1], patch.high[1]);
            let (first, end) = (self.cells[cells.start as usize], self.cells[cells.end as usize]);
            let mut members = self.members[first as usize..end as usize].iter();
            if members.any(|member| member.may_stand_before(&sought) && way.is_blocked(mesh, moved, member.idx)) {
                return Some(true);
            }
        }
        Some(false)
    }
}

/// One of the ways of light, to a point on a triangle.
pub(crate) struct Way<'w> {
    pub ways: &'w Ways,
    pub lane: usize,
    pub from: &'w Vector3<f64>,
    pub to: &'w Vector3<f64>,
    pub triangle: u32,
}

impl Way<'_> {
    #[inline]
    fn is_blocked(&self, mesh: &Mesh, moved: &Vector3<f64>, idx: u32) -> bool {
        let origin = mesh.plate.point_mm + moved;
        let (way, from) = (mesh.plate.local(&(self.to - self.from)), mesh.plate.local(&(self.from - origin)));
        mesh.solid.stands_before(idx, &from, &way, self.ways.hidden_beyond[self.lane])
    }
}

/// The ways of light to a stretch of pixels.
#[derive(Debug)]
pub(crate) struct Ways {
    /// Bounds along and across the band and greatest depth of each way inside the ball around the part.
    low: [Block; 2],
    high: [Block; 2],
    farthest: Block,
    /// The share of each way that counts: what it meets beyond is its end itself.
    hidden_beyond: Block,
    /// Whether it may meet the ball.
    near: [bool; WORD_PX],
    /// Whether it lies before the viewpoint.
    before: [bool; WORD_PX],
}

impl Default for Ways {
    fn default() -> Self {
        Self {
            low: [NOTHING; 2],
            high: [NOTHING; 2],
            farthest: NOTHING,
            hidden_beyond: NOTHING,
            near: [false; WORD_PX],
            before: [false; WORD_PX],
        }
    }
}

impl Ways {
    /// Follows the first `n` ways.
    pub(crate) fn follow(&mut self, band: &Band, ball: &Ball, from: &[Block; 3], to: &[Block; 3], n: usize) {
        follow(self, band, ball, from, to, n.min(WORD_PX));
    }

    /// Whether a way comes near the part.
    pub(crate) fn is_near(&self, lane: usize) -> bool {
        self.near[lane]
    }

    fn patch(&self, lane: usize) -> Option<Patch> {
        let corner = |block: &[Block; 2]| [block[0][lane], block[1][lane]];
        let depth_mm = [0.0, self.farthest[lane]];
        self.before[lane].then(|| Patch { low: corner(&self.low), high: corner(&self.high), depth_mm })
    }
}

/// [`Ways::follow`]: the ball's test is that of [`Ball::is_near`].
#[multiversion(targets("x86_64+avx2"))]
fn follow(ways: &mut Ways, band: &Band, ball: &Ball, from: &[Block; 3], to: &[Block; 3], n: usize) {
    let Ways { low: [low_u, low_v], high: [high_u, high_v], farthest, hidden_beyond, near, before } = ways;
    let ([fx, fy, fz], [tx, ty, tz]) = (from, to);
    let (centre, radius_2) = (ball.centre_mm, ball.radius_mm * ball.radius_mm);
    let (axes, viewpoint) = (band.axes, band.viewpoint);
    for lane in 0..n {
        let (origin, end) = ([fx[lane], fy[lane], fz[lane]], [tx[lane], ty[lane], tz[lane]]);
        let way = [end[0] - origin[0], end[1] - origin[1], end[2] - origin[2]];
        let to_centre = [centre.x - origin[0], centre.y - origin[1], centre.z - origin[2]];
        let square = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
        let length = square.sqrt();
        let beside = [
            to_centre[1] * way[2] - to_centre[2] * way[1],
            to_centre[2] * way[0] - to_centre[0] * way[2],
            to_centre[0] * way[1] - to_centre[1] * way[0],
        ];
        let beside = beside[0] * beside[0] + beside[1] * beside[1] + beside[2] * beside[2];
        near[lane] = beside <= radius_2 * square * (1.0 + SAME_HIT_MM);
        let along = to_centre[0] * way[0] + to_centre[1] * way[1] + to_centre[2] * way[2];
        let enter = (along / length - ball.radius_mm) / length;
        let enter = if enter > 0.0 { enter } else { 0.0 };
        let enter = if enter < 1.0 { enter } else { 1.0 };
        let start = [0, 1, 2].map(|axis: usize| origin[axis] + way[axis] * enter);
        let seen = |point: [f64; 3]| {
            let at = [0, 1, 2].map(|axis: usize| point[axis] - viewpoint[axis]);
            let [x, y, z] = [0, 1, 2]
                .map(|row: usize| axes[(row, 0)] * at[0] + axes[(row, 1)] * at[1] + axes[(row, 2)] * at[2]);
            [x / z, y / z, z]
        };
        let (a, b) = (seen(start), seen(end));
        let ordered = |axis: usize| if a[axis] < b[axis] { (a[axis], b[axis]) } else { (b[axis], a[axis]) };
        (low_u[lane], high_u[lane]) = ordered(0);
        (low_v[lane], high_v[lane]) = ordered(1);
        let (nearest, deepest) = ordered(2);
        farthest[lane] = deepest;
        before[lane] = nearest > 0.0;
        let reach = if length > 1.0 { length } else { 1.0 };
        hidden_beyond[lane] = (length - SAME_HIT_MM * reach) / length;
    }
}
