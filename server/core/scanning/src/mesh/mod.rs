//! A surface mesh from the ordered profiles of a cloud.
//!
//! The points of one order form a grid: frame × position along the line. Neighbouring frames are stitched
//! together, triangles with long edges or steep depth steps are omitted, and where several orders cover the same
//! area the best of them is kept, so that the mesh has a single layer.

mod coverage;
mod stitch;

use std::collections::BTreeMap;

use nalgebra::Vector3;
use optics::{CameraFrame, PointMm};

use crate::error::ContentError;
use crate::input::stage_positions::StagePositions;
use crate::points::cloud::{Cloud, CloudPoint};
use coverage::Coverage;
use statistics::median;

/// Triangles over vertices, in the part frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Positions, mm.
    pub vertices_mm: Vec<[f64; 3]>,
    /// Corners as indices of `vertices_mm`, anticlockwise as viewed from the camera.
    pub triangles: Vec<[u32; 3]>,
    /// Comments, stored in formats that support them.
    pub comments: Vec<String>,
}

/// Limits of connectivity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshParams {
    /// Longest lateral edge, in spacings of the grid (median along the line and along the travel, added in
    /// quadrature). 3 bridges one missing neighbour on each side, but no real gap.
    pub max_edge_spacings: f64,
    /// Steepest edge, mm of depth per mm across. 4 is 76°: steeper surfaces are interrupted by occlusion.
    pub max_slope: f64,
}

impl Default for MeshParams {
    fn default() -> Self {
        Self { max_edge_spacings: 3.0, max_slope: 4.0 }
    }
}

/// Meshes a cloud: per order along line and travel, then merged into one layer.
///
/// Orders are added from the smallest median σ to the largest (equal σ: from the lowest |order|); a triangle of a
/// later order is kept only if its centre is not covered by an earlier layer (same lateral position, same depth
/// within the edge limit). Gaps of up to half a frame step may remain at seams between orders. Points are not
/// moved or smoothed.
pub fn mesh_from_cloud(cloud: &Cloud, params: &MeshParams) -> Mesh {
    let mut layers: Vec<Layer> =
        points_by_order(&cloud.points).into_values().map(|idx| layer(cloud, &idx)).collect();
    layers.sort_by(|a, b| {
        a.sigma_mm.total_cmp(&b.sigma_mm).then(a.order.unsigned_abs().cmp(&b.order.unsigned_abs()))
    });
    let Some(limits) = stitch::Limits::from_layers(&cloud.points, &layers, params) else {
        return Mesh { comments: cloud.comments.clone(), ..Mesh::default() };
    };
    let stage = StagePositions::from_comments(&cloud.comments);
    let camera_in = |frame: u32| {
        let camera = PointMm::<CameraFrame>::new(Vector3::zeros());
        stage
            .as_ref()
            .and_then(|stage| stage.part_from_camera(&camera, frame))
            .map_or(Vector3::zeros(), |at| at.xyz)
    };
    let mut coverage = Coverage::new(limits.cell_mm, limits.edge_mm);
    let mut kept: Vec<[u32; 3]> = Vec::new();
    for layer in &layers {
        let mut triangles = stitch::triangles(&cloud.points, layer, &limits);
        orient_towards_camera(&cloud.points, &mut triangles, camera_in);
        let corners = |t: &[u32; 3]| t.map(|idx| position(&cloud.points[idx as usize]));
        triangles.retain(|t| !coverage.covers(&corners(t)));
        for triangle in &triangles {
            coverage.add(&corners(triangle));
        }
        kept.extend(triangles);
    }
    compact(cloud, kept)
}

/// The profiles of one order.
pub(crate) struct Layer {
    order: i8,
    /// Median σ of the points.
    sigma_mm: f64,
    /// The pixel coordinate that runs along the line.
    along: fn(&CloudPoint) -> f32,
    /// Point indices of each frame, sorted along the line.
    profiles: Vec<Vec<u32>>,
}

fn points_by_order(points: &[CloudPoint]) -> BTreeMap<i8, Vec<u32>> {
    let mut by_order: BTreeMap<i8, Vec<u32>> = BTreeMap::new();
    for (idx, point) in (0u32..).zip(points) {
        by_order.entry(point.order).or_default().push(idx);
    }
    by_order
}

fn layer(cloud: &Cloud, indices: &[u32]) -> Layer {
    let at = |idx: u32| &cloud.points[idx as usize];
    let mut sigmas: Vec<f64> = indices.iter().map(|&idx| f64::from(at(idx).sigma_mm)).collect();
    let mut frames: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &idx in indices {
        frames.entry(at(idx).frame).or_default().push(idx);
    }
    let along = line_coordinate(frames.values().map(|profile| profile.iter().map(|&idx| at(idx))));
    let mut profiles: Vec<Vec<u32>> = frames.into_values().collect();
    for profile in &mut profiles {
        profile.sort_by(|&a, &b| along(at(a)).total_cmp(&along(at(b))).then(a.cmp(&b)));
    }
    Layer { order: at(indices[0]).order, sigma_mm: median(&mut sigmas).unwrap_or(0.0), along, profiles }
}

/// u or v, whichever varies more within the profiles.
fn line_coordinate<'a>(
    profiles: impl Iterator<Item = impl Iterator<Item = &'a CloudPoint>>,
) -> fn(&CloudPoint) -> f32 {
    let (mut u_total, mut v_total) = (0.0, 0.0);
    for profile in profiles {
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for p in profile {
            low = [low[0].min(p.u_px), low[1].min(p.v_px)];
            high = [high[0].max(p.u_px), high[1].max(p.v_px)];
        }
        u_total += f64::from(high[0] - low[0]);
        v_total += f64::from(high[1] - low[1]);
    }
    if u_total >= v_total { |p| p.u_px } else { |p| p.v_px }
}

pub(crate) fn position(point: &CloudPoint) -> Vector3<f64> {
    Vector3::new(point.x_mm, point.y_mm, point.z_mm)
}

/// Orients all triangles of a layer alike: towards the camera, by the majority of their area.
///
/// `camera_in`: position of the camera in a frame, part frame.
fn orient_towards_camera(
    points: &[CloudPoint],
    triangles: &mut [[u32; 3]],
    camera_in: impl Fn(u32) -> Vector3<f64>,
) {
    let away: f64 = triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|idx| position(&points[idx as usize]));
            let ray = (a + b + c) / 3.0 - camera_in(points[triangle[0] as usize].frame);
            (b - a).cross(&(c - a)).dot(&ray.normalize())
        })
        .sum();
    if away > 0.0 {
        triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
}

/// Keeps only the points used by triangles.
fn compact(cloud: &Cloud, mut triangles: Vec<[u32; 3]>) -> Mesh {
    let mut places = vec![u32::MAX; cloud.points.len()];
    let mut n_used = 0;
    for idx in triangles.iter_mut().flatten() {
        let place = &mut places[*idx as usize];
        if *place == u32::MAX {
            *place = n_used;
            n_used += 1;
        }
        *idx = *place;
    }
    let mut vertices_mm = vec![[0.0; 3]; n_used as usize];
    for (place, point) in places.iter().zip(&cloud.points).filter(|(place, _)| **place != u32::MAX) {
        vertices_mm[*place as usize] = position(point).into();
    }
    Mesh { vertices_mm, triangles, comments: cloud.comments.clone() }
}

impl Mesh {
    /// Unit normal of a triangle; zero if it has no area.
    pub fn triangle_normal(&self, triangle: &[u32; 3]) -> [f64; 3] {
        self.area_normal(triangle).try_normalize(f64::MIN_POSITIVE).unwrap_or_default().into()
    }

    /// Unit normals of the vertices, area-weighted means of their triangles; +z where there is none.
    pub fn vertex_normals(&self) -> Vec<[f64; 3]> {
        let mut sums = vec![Vector3::zeros(); self.vertices_mm.len()];
        for triangle in &self.triangles {
            let normal = self.area_normal(triangle);
            triangle.iter().for_each(|idx| sums[*idx as usize] += normal);
        }
        sums.iter().map(|sum| sum.try_normalize(f64::MIN_POSITIVE).unwrap_or(-Vector3::z()).into()).collect()
    }

    fn area_normal(&self, triangle: &[u32; 3]) -> Vector3<f64> {
        let [a, b, c] = triangle.map(|idx| Vector3::from(self.vertices_mm[idx as usize]));
        (b - a).cross(&(c - a))
    }

    /// The mesh, if every corner exists and every position is finite.
    pub(crate) fn checked(self) -> Result<Self, ContentError> {
        let remedy = "export the mesh again";
        if let Some(idx) = self.vertices_mm.iter().position(|v| v.iter().any(|value| !value.is_finite())) {
            return Err(ContentError::malformed(
                format!("vertex {idx}"),
                "a value is not a finite number",
                remedy,
            ));
        }
        let n = self.vertices_mm.len();
        match self.triangles.iter().position(|t| t.iter().any(|&corner| corner as usize >= n)) {
            Some(idx) => Err(ContentError::malformed(
                format!("triangle {idx}"),
                format!("it refers to a vertex beyond the {n} in the file"),
                remedy,
            )),
            None => Ok(self),
        }
    }
}

#[cfg(test)]
mod tests;
