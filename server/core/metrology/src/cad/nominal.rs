//! The nominal surface of a part: triangles with the pseudonormals that determine on which side of them a point lies.
//!
//! At an edge or a vertex the normal of one adjacent face may give the wrong side; the sum of the adjacent faces'
//! normals, at a vertex weighted by their angles, never does (Bærentzen and Aanæs, IEEE TVCG 11(3), 2005).

use std::borrow::Cow;
use std::collections::HashMap;

use nalgebra::Vector3;
use remedy::Remedy;
use scanning::Mesh;

use crate::cad::tree::Tree;

/// Edges sharper than this are edges of the part, not of its tessellation (cosine, 30°).
const SMOOTH_COSINE: f64 = 0.866;

/// Triangles with less area than this fraction of their longest side squared are degenerate and removed.
const MIN_SLIMNESS: f64 = 1e-9;

/// Why a mesh cannot serve as nominal surface.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NominalError {
    /// It has no triangle with an area.
    #[error("the mesh has no triangles with an area")]
    Empty,
    /// Neighbouring triangles face opposite sides.
    #[error("{n_edges} edges of the mesh lie between triangles that face opposite sides")]
    NotOriented {
        /// How many edges.
        n_edges: usize,
    },
}

impl Remedy for NominalError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some("export the part again as one oriented surface".into())
    }
}

/// The element of a triangle that is nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FacetRegion {
    Face,
    /// Between corner k and the next.
    Edge(u8),
    Corner(u8),
}

/// A triangle with its unit normal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Facet {
    pub(crate) corners: [Vector3<f64>; 3],
    pub(crate) normal: Vector3<f64>,
}

/// The nominal surface.
pub struct Nominal {
    pub(crate) facets: Vec<Facet>,
    /// Sum of the normals on both sides of every edge; zero at a free edge.
    edges: Vec<[Vector3<f32>; 3]>,
    /// Angle-weighted normals of every corner; zero where a free edge ends.
    corners: Vec<[Vector3<f32>; 3]>,
    /// Largest distance of the true surface from a facet (chordal deviation, mm).
    pub(crate) sag_mm: Vec<f32>,
    /// Strongest curvature across the edges of a facet, 1/mm.
    pub(crate) curvature: Vec<f32>,
    pub(crate) tree: Tree,
    /// Whether it is closed, i.e. has no free edge.
    pub is_closed: bool,
    /// Area, mm².
    pub area_mm2: f64,
    /// Diagonal of its bounding box, mm.
    pub diagonal_mm: f64,
}

/// The surface point nearest to a point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    pub(crate) facet: u32,
    pub(crate) at: Vector3<f64>,
    pub(crate) region: FacetRegion,
}

impl Nominal {
    /// From a mesh: coincident vertices are merged; a closed surface that is inside out is reversed.
    ///
    /// # Errors
    /// [`NominalError`].
    pub fn new(mesh: &Mesh) -> Result<Self, NominalError> {
        let (vertices, mut triangles) = joined(mesh);
        if triangles.is_empty() {
            return Err(NominalError::Empty);
        }
        let volume: f64 = triangles.iter().map(|t| determinant(&t.map(|v| vertices[v as usize]))).sum();
        let neighbours = neighbours(&triangles)?;
        let is_closed = triangles.iter().all(|t| (0..3).all(|k| neighbours.contains_key(&(t[(k + 1) % 3], t[k]))));
        let is_inside_out = is_closed && volume < 0.0;
        if is_inside_out {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        let neighbours = if is_inside_out { self::neighbours(&triangles)? } else { neighbours };
        let mut facets: Vec<Facet> = triangles.iter().map(|t| facet(&t.map(|v| vertices[v as usize]))).collect();
        let tree = Tree::new(&facets);
        let order: Vec<u32> = tree.order().to_vec();
        let beyond = |t: &[u32; 3], k: usize| neighbours.get(&(t[(k + 1) % 3], t[k])).map(|other| *other as usize);
        let mut of_vertices = vec![Vector3::zeros(); vertices.len()];
        let mut is_free = vec![false; vertices.len()];
        for (idx, triangle) in triangles.iter().enumerate() {
            for k in 0..3 {
                of_vertices[triangle[k] as usize] += facets[idx].normal * facets[idx].angle(k);
                if beyond(triangle, k).is_none() {
                    is_free[triangle[k] as usize] = true;
                    is_free[triangle[(k + 1) % 3] as usize] = true;
                }
            }
        }
        let edges = triangles.iter().enumerate().map(|(idx, t)| {
            [0, 1, 2].map(|k| {
                beyond(t, k).map_or(Vector3::zeros(), |other| (facets[idx].normal + facets[other].normal).cast())
            })
        });
        let edges: Vec<[Vector3<f32>; 3]> = edges.collect();
        let corner = |v: u32| if is_free[v as usize] { Vector3::zeros() } else { of_vertices[v as usize].cast() };
        let corners: Vec<[Vector3<f32>; 3]> = triangles.iter().map(|t| t.map(corner)).collect();
        let bend = |idx: usize, t: &[u32; 3]| {
            let of_edge =
                |k: usize| beyond(t, k).map_or((0.0, 0.0), |other| bend(&facets[idx], &facets[other], k));
            let most = |(sag, curved): (f64, f64), (other, too): (f64, f64)| (sag.max(other), curved.max(too));
            (0..3).map(of_edge).fold((0.0, 0.0), most)
        };
        let bends: Vec<(f64, f64)> = triangles.iter().enumerate().map(|(idx, t)| bend(idx, t)).collect();
        let area_mm2 = facets.iter().map(Facet::area_mm2).sum();
        let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let (low, high) = vertices.iter().fold(start, |(low, high), v| (low.inf(v), high.sup(v)));
        // In the order of the tree's leaves.
        facets = order.iter().map(|idx| facets[*idx as usize]).collect();
        Ok(Self {
            facets,
            edges: order.iter().map(|idx| edges[*idx as usize]).collect(),
            corners: order.iter().map(|idx| corners[*idx as usize]).collect(),
            sag_mm: order.iter().map(|idx| bends[*idx as usize].0 as f32).collect(),
            curvature: order.iter().map(|idx| bends[*idx as usize].1 as f32).collect(),
            tree,
            is_closed,
            area_mm2,
            diagonal_mm: (high - low).norm(),
        })
    }

    /// Number of triangles, without degenerate ones.
    pub fn n_triangles(&self) -> usize {
        self.facets.len()
    }

    /// Smallest and largest x, y, z, mm.
    pub fn bounds_mm(&self) -> [[f64; 3]; 2] {
        let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let corners = self.facets.iter().flat_map(|facet| &facet.corners);
        let (low, high) = corners.fold(start, |(low, high), corner| (low.inf(corner), high.sup(corner)));
        [low.into(), high.into()]
    }

    /// Area, mm².
    pub fn area_mm2(&self) -> f64 {
        self.area_mm2
    }

    /// The nearest surface point on a facet that faces the camera (against `ray`), within a squared distance; `guess`: the
    /// facet nearest to a neighbouring point.
    pub(crate) fn nearest(
        &self,
        at: &Vector3<f64>,
        ray: &Vector3<f64>,
        square: f64,
        guess: Option<u32>,
    ) -> Option<Nearest> {
        self.tree.nearest(&self.facets, at, ray, square, guess)
    }

    /// The pseudonormal at a surface point, which determines the sign of the distance; `None` on a free edge, beyond which
    /// there is no surface to compare with.
    pub(crate) fn normal(&self, nearest: &Nearest) -> Option<Vector3<f64>> {
        let facet = nearest.facet as usize;
        let sum = match nearest.region {
            FacetRegion::Face => return Some(self.facets[facet].normal),
            FacetRegion::Edge(k) => self.edges[facet][k as usize],
            FacetRegion::Corner(k) => self.corners[facet][k as usize],
        };
        sum.cast::<f64>().try_normalize(1e-9)
    }
}

impl Facet {
    pub(crate) fn area_mm2(&self) -> f64 {
        let [a, b, c] = self.corners;
        (b - a).cross(&(c - a)).norm() / 2.0
    }

    fn angle(&self, k: usize) -> f64 {
        let (a, b, c) = (self.corners[k], self.corners[(k + 1) % 3], self.corners[(k + 2) % 3]);
        (b - a).angle(&(c - a))
    }

    /// The point of the triangle nearest to `p`, by Voronoi regions (Ericson, Real-Time Collision Detection, 5.1.5).
    pub(crate) fn nearest(&self, p: &Vector3<f64>) -> (Vector3<f64>, FacetRegion) {
        let [a, b, c] = self.corners;
        let (ab, ac, ap) = (b - a, c - a, p - a);
        let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return (a, FacetRegion::Corner(0));
        }
        let bp = p - b;
        let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
        if d3 >= 0.0 && d4 <= d3 {
            return (b, FacetRegion::Corner(1));
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return (a + ab * (d1 / (d1 - d3)), FacetRegion::Edge(0));
        }
        let cp = p - c;
        let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
        if d6 >= 0.0 && d5 <= d6 {
            return (c, FacetRegion::Corner(2));
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return (a + ac * (d2 / (d2 - d6)), FacetRegion::Edge(2));
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
            return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), FacetRegion::Edge(1));
        }
        let whole = 1.0 / (va + vb + vc);
        (a + ab * (vb * whole) + ac * (vc * whole), FacetRegion::Face)
    }
}

fn facet(corners: &[Vector3<f64>; 3]) -> Facet {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::z);
    Facet { corners: *corners, normal }
}

fn determinant([a, b, c]: &[Vector3<f64>; 3]) -> f64 {
    a.dot(&b.cross(c))
}

/// The mesh with coincident vertices merged (files repeat them) and degenerate triangles removed.
fn joined(mesh: &Mesh) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let mut idx_of: HashMap<[u64; 3], u32> = HashMap::with_capacity(mesh.vertices_mm.len());
    let mut vertices: Vec<Vector3<f64>> = Vec::with_capacity(mesh.vertices_mm.len());
    let join = |vertex: &[f64; 3]| {
        // −0 and 0 are the same coordinate.
        *idx_of.entry(vertex.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
            vertices.push(Vector3::from(*vertex));
            (vertices.len() - 1) as u32
        })
    };
    let new_idx: Vec<u32> = mesh.vertices_mm.iter().map(join).collect();
    let triangles = mesh.triangles.iter().map(|triangle| triangle.map(|v| new_idx[v as usize]));
    let has_area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| vertices[v as usize]);
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        (b - a).cross(&(c - a)).norm() > MIN_SLIMNESS * longest
    };
    let triangles = triangles.filter(has_area).collect();
    (vertices, triangles)
}

/// The triangle of every directed edge.
fn neighbours(triangles: &[[u32; 3]]) -> Result<HashMap<(u32, u32), u32>, NominalError> {
    let mut of_edge = HashMap::with_capacity(3 * triangles.len());
    let mut n_edges = 0;
    for (idx, triangle) in triangles.iter().enumerate() {
        for k in 0..3 {
            n_edges += usize::from(of_edge.insert((triangle[k], triangle[(k + 1) % 3]), idx as u32).is_some());
        }
    }
    if n_edges > 0 { Err(NominalError::NotOriented { n_edges }) } else { Ok(of_edge) }
}

/// Chordal deviation of a smooth surface through two facets, and its curvature across their common edge: ℓ·θ/8 and θ/ℓ for
/// facets whose centres are ℓ apart and whose normals differ by θ.
fn bend(facet: &Facet, other: &Facet, k: usize) -> (f64, f64) {
    let cosine = facet.normal.dot(&other.normal);
    if cosine < SMOOTH_COSINE {
        return (0.0, 0.0);
    }
    let edge = (facet.corners[(k + 1) % 3] - facet.corners[k]).norm();
    let height = (facet.area_mm2() + other.area_mm2()) / edge;
    let turn = facet.normal.cross(&other.normal).norm().atan2(cosine);
    (height * turn / 8.0, turn / height)
}
