//! A triangle mesh with a bounding-volume hierarchy for ray intersection.

mod shadows;

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::Vector3;
use remedy::Remedy;

use crate::model::random::derived_seed;
use crate::params::PART_REFLECTANCE;
use crate::part::scene::{Ball, Plate, SceneHit};

/// Triangles per leaf of the tree: testing a few costs less than another level.
const LEAF_TRIANGLES: usize = 4;

/// Greatest depth of the tree: each level halves the triangles, so 2³² of them would fit.
const MAX_DEPTH: usize = 48;

/// Tolerance of the intersection test beyond a triangle's edges, as a fraction of its sides: closes the seams.
pub(crate) const SEAM: f64 = 1e-9;

/// Largest part, mm: larger numbers indicate a wrong unit.
const MAX_SIZE_MM: f64 = 10_000.0;

/// Why triangles do not form a part.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolidError {
    /// No triangle that a ray could hit.
    #[error("the part has no triangle with an area")]
    Empty,
    /// A corner with a coordinate that is not finite.
    #[error("triangle {triangle_idx} has a corner that is not finite")]
    NotFinite {
        /// Index of the triangle, from 0.
        triangle_idx: usize,
    },
    /// So large or far away that its unit must be wrong.
    #[error("the part reaches over {size_mm} mm, more than {max_mm} mm")]
    TooLarge {
        /// Largest side of its bounding box.
        size_mm: f64,
        /// The permitted size.
        max_mm: f64,
    },
}

impl Remedy for SolidError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::Empty => "export it again",
            Self::NotFinite { .. } => "repair the mesh",
            Self::TooLarge { .. } => "export it in millimetres",
        }))
    }
}

/// Triangles in their own frame (mm, z up), centred in x and y and standing on z = 0.
#[derive(Debug, PartialEq)]
pub struct Solid {
    triangles: Vec<Triangle>,
    /// Unit normals of the triangles, of either sign.
    normals: Vec<Vector3<f64>>,
    /// Distinct corners, and the corner indices of the triangles.
    corners: Vec<Vector3<f64>>,
    corner_idx: Vec<[u32; 3]>,
    nodes: Vec<Node>,
    fingerprint: u64,
}

/// A mesh that stands on a plate: its x and y along the plate's first two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// The plate.
    pub plate: Plate,
    /// The part.
    pub solid: Arc<Solid>,
}

/// A corner and its two sides.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Triangle {
    corner: Vector3<f64>,
    sides: [Vector3<f64>; 2],
}

/// A bounding box: of `count` triangles from `first`, or, if `count` is 0, of the nodes `first` and the next one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    low: Vector3<f64>,
    high: Vector3<f64>,
    first: u32,
    count: u32,
}

/// A ray prepared for many box tests.
struct Ray {
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    inverse: Vector3<f64>,
}

impl Solid {
    /// Builds the part from its triangles (three corners each, mm). Triangles without area are left out.
    ///
    /// # Errors
    /// [`SolidError`] if nothing remains, a corner is not finite, or it cannot be in millimetres.
    pub fn new(corners: &[[[f64; 3]; 3]]) -> Result<Self, SolidError> {
        if let Some(triangle_idx) = corners.iter().position(|t| !t.as_flattened().iter().all(|x| x.is_finite())) {
            return Err(SolidError::NotFinite { triangle_idx });
        }
        let points = corners.as_flattened().iter().copied().map(Vector3::from);
        let (low, high) = points.clone().fold(empty_box(), |(low, high), p| (low.inf(&p), high.sup(&p)));
        let size_mm = (high - low).max();
        if size_mm > MAX_SIZE_MM {
            return Err(SolidError::TooLarge { size_mm, max_mm: MAX_SIZE_MM });
        }
        let foot = Vector3::new((low.x + high.x) / 2.0, (low.y + high.y) / 2.0, low.z);
        let standing: Vec<[Vector3<f64>; 3]> = corners
            .iter()
            .map(|t| t.map(|corner| Vector3::from(corner) - foot))
            .filter(|[a, b, c]| (b - a).cross(&(c - a)).norm_squared() > 0.0)
            .collect();
        if standing.is_empty() {
            return Err(SolidError::Empty);
        }
        let (corners_once, mut corner_idx) = numbered(&standing);
        let mut triangles: Vec<Triangle> =
            standing.iter().map(|[a, b, c]| Triangle { corner: *a, sides: [b - a, c - a] }).collect();
        let fingerprint = corners.as_flattened().as_flattened().iter().map(|x| x.to_bits()).fold(6, derived_seed);
        let mut nodes = Vec::with_capacity(triangles.len());
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        build(&triangles, &mut order, 0, 0, &mut nodes);
        triangles = order.iter().map(|&idx| triangles[idx as usize]).collect();
        corner_idx = order.iter().map(|&idx| corner_idx[idx as usize]).collect();
        let normals = triangles.iter().map(Triangle::normal).collect();
        Ok(Self { triangles, normals, corners: corners_once, corner_idx, nodes, fingerprint })
    }

    /// Number of triangles.
    pub fn n_triangles(&self) -> usize {
        self.triangles.len()
    }

    pub(crate) fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// Number of distinct corners.
    pub(crate) fn n_corners(&self) -> usize {
        self.corners.len()
    }

    /// A corner in the part's frame.
    pub(crate) fn corner(&self, idx: u32) -> Vector3<f64> {
        self.corners[idx as usize]
    }

    /// Corner indices of a triangle.
    pub(crate) fn corner_idx(&self, triangle: u32) -> [u32; 3] {
        self.corner_idx[triangle as usize]
    }

    /// Unit normal of a triangle in the part's frame, of either sign.
    pub(crate) fn normal(&self, idx: u32) -> Vector3<f64> {
        self.normals[idx as usize]
    }

    /// Calls a function for the triangles of all nodes for whose bounding spheres (centre and radius) `may` returns
    /// true.
    pub(crate) fn for_each_in(&self, may: impl Fn(&Vector3<f64>, f64) -> bool, mut each: impl FnMut(u32)) {
        let mut waiting = vec![0];
        while let Some(idx) = waiting.pop() {
            let node: &Node = &self.nodes[idx];
            if !may(&((node.low + node.high) / 2.0), (node.high - node.low).norm() / 2.0) {
                continue;
            }
            if node.count > 0 {
                (node.first..node.first + node.count).for_each(&mut each);
            } else {
                waiting.extend([node.first as usize, idx + 1]);
            }
        }
    }

    /// The nearest triangle on a ray: ray length, and the normal towards the ray's origin.
    fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
        let (ray_length, idx) = self.search(&Ray::new(origin, direction), f64::INFINITY, false)?;
        let normal = self.normals[idx];
        Some((ray_length, if normal.dot(direction) > 0.0 { -normal } else { normal }))
    }

    /// The nearest triangle on a ray within `limit`, and its ray length; with `any` the first one found, for occlusion
    /// tests.
    #[inline]
    fn search(&self, ray: &Ray, limit: f64, any: bool) -> Option<(f64, usize)> {
        let mut nearest = (limit, None);
        let mut stack = [(0.0, 0_u32); MAX_DEPTH + 1];
        let mut waiting = usize::from(self.nodes[0].enter(ray) < limit);
        while waiting > 0 {
            waiting -= 1;
            let (enter, idx) = (stack[waiting].0, stack[waiting].1 as usize);
            let node = &self.nodes[idx];
            if enter >= nearest.0 {
                continue;
            }
            let first = node.first as usize;
            if node.count > 0 {
                for (offset, triangle) in self.triangles[first..first + node.count as usize].iter().enumerate() {
                    if let Some(ray_length) = triangle
                        .ray_length(&ray.origin, &ray.direction)
                        .filter(|ray_length| *ray_length < nearest.0)
                    {
                        nearest = (ray_length, Some(first + offset));
                        if any {
                            return Some((ray_length, first + offset));
                        }
                    }
                }
                continue;
            }
            let children = [idx + 1, first];
            let enter = [self.nodes[idx + 1].enter(ray), self.nodes[first].enter(ray)];
            // The nearer one is searched first, so that it can exclude the other.
            let order = if enter[0] <= enter[1] { [1, 0] } else { [0, 1] };
            for side in order {
                if enter[side] < nearest.0 {
                    stack[waiting] = (enter[side], children[side] as u32);
                    waiting += 1;
                }
            }
        }
        Some((nearest.0, nearest.1?))
    }
}

impl Mesh {
    pub(crate) fn solid_hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<SceneHit> {
        let from = self.plate.local(&(origin - self.plate.point_mm));
        let (ray_length, normal) = self.solid.hit(&from, &self.plate.local(direction))?;
        Some(SceneHit { ray_length, normal: self.plate.axes * normal, reflectance: PART_REFLECTANCE })
    }

    /// A bounding sphere of the part.
    pub(crate) fn ball(&self) -> Ball {
        let Node { low, high, .. } = self.solid.nodes[0];
        let centre_mm = self.plate.point_mm + self.plate.axes * ((low + high) / 2.0);
        Ball { centre_mm, radius_mm: (high - low).norm() / 2.0 }
    }

    /// Whether a triangle intersects a ray before `limit`.
    pub(crate) fn is_in_the_way(&self, origin: &Vector3<f64>, direction: &Vector3<f64>, limit: f64) -> bool {
        let from = self.plate.local(&(origin - self.plate.point_mm));
        let ray = Ray::new(&from, &self.plate.local(direction));
        self.solid.search(&ray, limit, true).is_some()
    }
}

impl Ray {
    fn new(origin: &Vector3<f64>, direction: &Vector3<f64>) -> Self {
        Self { origin: *origin, direction: *direction, inverse: direction.map(f64::recip) }
    }
}

impl Triangle {
    fn normal(&self) -> Vector3<f64> {
        self.sides[0].cross(&self.sides[1]).normalize()
    }

    fn corners(&self) -> [Vector3<f64>; 3] {
        [self.corner, self.corner + self.sides[0], self.corner + self.sides[1]]
    }

    fn middle(&self) -> Vector3<f64> {
        self.corner + (self.sides[0] + self.sides[1]) / 3.0
    }

    /// Intersection with a ray (Möller & Trumbore 1997), from either side.
    #[inline(always)]
    fn ray_length(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let [a, b] = &self.sides;
        let p = direction.cross(b);
        let scale = a.dot(&p).recip();
        let from = origin - self.corner;
        let u = from.dot(&p) * scale;
        let q = from.cross(a);
        let v = direction.dot(&q) * scale;
        let ray_length = b.dot(&q) * scale;
        // NaN if the ray is parallel to the triangle: no comparison holds.
        (u >= -SEAM && v >= -SEAM && u + v <= 1.0 + SEAM && ray_length > 0.0).then_some(ray_length)
    }
}

impl Node {
    /// Ray length at which the box is entered; infinite if it is missed (Kay & Kajiya 1986).
    #[inline(always)]
    fn enter(&self, ray: &Ray) -> f64 {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let a = (self.low[axis] - ray.origin[axis]) * ray.inverse[axis];
            let b = (self.high[axis] - ray.origin[axis]) * ray.inverse[axis];
            // One instruction each, unlike `min` and `max`; NaN (in the plane of a side) has no effect.
            let (near, far) = (if b < a { b } else { a }, if a > b { a } else { b });
            enter = if near > enter { near } else { enter };
            leave = if far < leave { far } else { leave };
        }
        if enter <= leave { enter } else { f64::INFINITY }
    }
}

fn empty_box() -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY))
}

/// Distinct corners of triangles, and the corner indices of each triangle.
fn numbered(triangles: &[[Vector3<f64>; 3]]) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let mut corners = Vec::with_capacity(triangles.len() / 2 + 2);
    let mut known = HashMap::with_capacity(triangles.len() / 2 + 2);
    let mut number = |corner: &Vector3<f64>| {
        // Adding 0 unifies the two zeros.
        let name = [0, 1, 2].map(|axis| (corner[axis] + 0.0).to_bits());
        *known.entry(name).or_insert_with(|| {
            corners.push(*corner);
            corners.len() as u32 - 1
        })
    };
    let corner_idx = triangles.iter().map(|triangle| triangle.each_ref().map(&mut number)).collect();
    (corners, corner_idx)
}

/// Adds the tree over the triangles of `order`, which begins at index `first`, halving them along the longest side of
/// their centroids' box.
fn build(triangles: &[Triangle], order: &mut [u32], first: usize, depth: usize, nodes: &mut Vec<Node>) {
    let grow = |(low, high): (Vector3<f64>, Vector3<f64>), p: Vector3<f64>| (low.inf(&p), high.sup(&p));
    let of = |idx: &u32| &triangles[*idx as usize];
    let (low, high) = order.iter().flat_map(|idx| of(idx).corners()).fold(empty_box(), grow);
    let idx = nodes.len();
    let (first_u32, count) = (first as u32, order.len() as u32);
    // Boxes are widened by the seam tolerance of the triangles.
    let margin = Vector3::repeat(SEAM * (high - low).max());
    nodes.push(Node { low: low - margin, high: high + margin, first: first_u32, count });
    if order.len() <= LEAF_TRIANGLES || depth >= MAX_DEPTH {
        return;
    }
    let (low, high) = order.iter().map(|idx| of(idx).middle()).fold(empty_box(), grow);
    let axis = (high - low).imax();
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |a, b| of(a).middle()[axis].total_cmp(&of(b).middle()[axis]));
    let (left, right) = order.split_at_mut(half);
    build(triangles, left, first, depth + 1, nodes);
    let second = nodes.len() as u32;
    build(triangles, right, first + half, depth + 1, nodes);
    (nodes[idx].first, nodes[idx].count) = (second, 0);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wavy sheet of 2·n² triangles over 40 × 40 mm.
    fn wave(n: usize) -> Vec<[[f64; 3]; 3]> {
        let at = |i: usize, j: usize| {
            let (x, y) = (40.0 * i as f64 / n as f64, 40.0 * j as f64 / n as f64);
            [x, y, 3.0 + 2.0 * (x / 5.0).sin() * (y / 7.0).cos()]
        };
        let squares = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        squares
            .flat_map(|(i, j)| {
                [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]]
            })
            .collect()
    }

    #[test]
    fn the_tree_finds_the_triangle_that_a_search_of_all_finds() {
        let solid = Solid::new(&wave(24)).unwrap();
        let mut hits = 0;
        for idx in 0..4000_u64 {
            let draw = |stream| derived_seed(idx, stream) as f64 / u64::MAX as f64 - 0.5;
            let origin = Vector3::new(60.0 * draw(0), 60.0 * draw(1), 50.0);
            let direction = Vector3::new(draw(2), draw(3), -1.0);
            let ray = Ray::new(&origin, &direction);
            let all = solid.triangles.iter().filter_map(|t| t.ray_length(&origin, &direction));
            let nearest = all.fold(f64::INFINITY, f64::min);
            let found = solid.hit(&origin, &direction).map_or(f64::INFINITY, |hit| hit.0);
            assert_eq!(found, nearest, "ray {idx}");
            let in_the_way = |limit: f64| solid.search(&ray, limit, true).is_some();
            assert!(!in_the_way(nearest) && in_the_way(nearest + 1e-9) == nearest.is_finite(), "ray {idx}");
            hits += usize::from(nearest.is_finite());
        }
        assert!((1000..4000).contains(&hits), "{hits}");
    }

    #[test]
    fn triangles_that_form_no_part_are_refused() {
        let flat = [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]];
        assert_eq!(Solid::new(&flat).unwrap_err(), SolidError::Empty);
        assert_eq!(Solid::new(&[]).unwrap_err(), SolidError::Empty);
        let mut broken = wave(2);
        broken[3][1][2] = f64::NAN;
        assert_eq!(Solid::new(&broken).unwrap_err(), SolidError::NotFinite { triangle_idx: 3 });
        let huge = [[[0.0, 0.0, 0.0], [2e7, 0.0, 0.0], [0.0, 5.0, 0.0]]];
        assert!(matches!(Solid::new(&huge).unwrap_err(), SolidError::TooLarge { .. }));
    }
}
