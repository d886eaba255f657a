//! A part of triangles in the light of one order: the few triangles that its sheet meets, and what stands between the
//! grating and a point.
//!
//! Seen from near the source a sheet is a thin band. A grid of cells along the band knows the triangles in each; a ray
//! of light, which need not pass that viewpoint exactly, is a short line in it and is tested against the triangles of the
//! cells along that line. So the result is that of a search of all triangles, whatever the viewpoint.

use nalgebra::{Matrix3, Vector3};
use optics::Grating;

use crate::mesh::{Mesh, Ray};
use crate::scene::{Ball, hidden_beyond};

/// No cell.
const NONE: u32 = u32::MAX;

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
    members: Vec<u32>,
    entries: Vec<(u32, u32)>,
}

/// Tangents along and across a band: lowest and highest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patch {
    low: [f64; 2],
    high: [f64; 2],
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
        let at = self.axes * (point - self.viewpoint);
        (at.z > 0.0).then(|| [at.x / at.z, at.y / at.z])
    }

    fn column(&self, along: f64) -> i64 {
        (along / self.cell).floor() as i64
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
        let [a, b, c] = corners.each_ref().map(|corner| self.tangents(corner));
        let (a, b, c) = (a?, b?, c?);
        let low = [0, 1].map(|axis: usize| a[axis].min(b[axis]).min(c[axis]));
        let high = [0, 1].map(|axis: usize| a[axis].max(b[axis]).max(c[axis]));
        Some(Patch { low, high })
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
        self.touches(&Patch { low: middle.map(|x| x - half), high: middle.map(|x| x + half) })
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
            let everywhere = Patch { low: [f64::NEG_INFINITY; 2], high: [f64::INFINITY; 2] };
            self.enter(band, &patch.unwrap_or(everywhere), idx);
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
        let from = ((low - band.columns[column][0]) / band.cell).floor().clamp(0.0, f64::from(end - first));
        let to = ((high - band.columns[column][0]) / band.cell + 1.0).floor().clamp(0.0, f64::from(end - first));
        first + from as u32..first + to as u32
    }

    fn enter(&mut self, band: &Band, patch: &Patch, idx: u32) {
        for column in band.columns_of(patch) {
            for cell in self.cells_of(band, column, patch.low[1], patch.high[1]) {
                self.entries.push((cell, idx));
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
        self.members.resize(self.entries.len(), NONE);
        for &(cell, idx) in &self.entries {
            let place = &mut self.cells[cell as usize + 1];
            self.members[*place as usize] = idx;
            *place += 1;
        }
    }

    /// Whether a triangle stands between `from` and `to`; `None` if the way does not lie in the band.
    pub(crate) fn is_in_the_way(
        &self,
        band: &Band,
        mesh: &Mesh,
        moved: &Vector3<f64>,
        ball: &Ball,
        from: &Vector3<f64>,
        to: &Vector3<f64>,
    ) -> Option<bool> {
        let way = to - from;
        let length = way.norm();
        let nearest = ((ball.centre_mm - from).dot(&way) / length - ball.radius_mm).clamp(0.0, length);
        let (a, b) = (band.tangents(&(from + way * (nearest / length)))?, band.tangents(to)?);
        let patch = Patch {
            low: [0, 1].map(|axis: usize| a[axis].min(b[axis])),
            high: [0, 1].map(|axis: usize| a[axis].max(b[axis])),
        };
        let columns = band.columns_of(&patch);
        if columns.len() as i64 != band.column(patch.high[0]) - band.column(patch.low[0]) + 1 {
            return None;
        }
        let origin = mesh.plate.point_mm + moved;
        let ray = Ray::new(&mesh.plate.local(&(from - origin)), &mesh.plate.local(&way));
        let limit = hidden_beyond(length) / length;
        for column in columns {
            let [low, high] = band.columns[column];
            if patch.low[1] < low || patch.high[1] > high {
                return None;
            }
            let cells = self.cells_of(band, column, patch.low[1], patch.high[1]);
            let (first, end) = (self.cells[cells.start as usize], self.cells[cells.end as usize]);
            let members = &self.members[first as usize..end as usize];
            if members.iter().any(|&idx| mesh.solid.stands_before(idx, &ray, limit)) {
                return Some(true);
            }
        }
        Some(false)
    }
}
