//! Projected corners of a part's triangles, each computed on first use: six triangles share a corner, and several
//! orders illuminate it.

use nalgebra::Vector3;
use optics::Camera;

use crate::part::mesh::Mesh;
use crate::part::scene::Plate;

/// A triangle in the camera frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlacedTriangle {
    pub corners: [Vector3<f64>; 3],
    /// Pixels of its corners; `None` behind the camera.
    pub pixels: [Option<[f64; 2]>; 3],
}

/// The corners of a part at the stage's position.
#[derive(Debug, Default)]
pub(crate) struct PlacedCorners {
    place: Option<Place>,
    /// Index of the pose; values computed for another pose are invalid.
    place_idx: u32,
    corners: Vec<PlacedCorner>,
}

/// Pose of a part, and its camera.
#[derive(Debug, Clone, PartialEq)]
struct Place {
    part: u64,
    plate: Plate,
    moved_mm: Vector3<f64>,
    camera: Camera,
}

#[derive(Debug, Clone, Copy)]
struct PlacedCorner {
    point_mm: Vector3<f64>,
    pixel: Option<[f64; 2]>,
    place_idx: u32,
}

impl PlacedTriangle {
    pub(crate) fn new(camera: &Camera, corners: [Vector3<f64>; 3]) -> Self {
        let project = |corner: &Vector3<f64>| camera.project(corner).map(|pixel| [pixel.x, pixel.y]);
        Self { corners, pixels: corners.each_ref().map(project) }
    }
}

impl PlacedCorners {
    /// Prepares for the triangles of a part at the stage's position.
    pub(crate) fn prepare(&mut self, camera: &Camera, mesh: &Mesh, moved: &Vector3<f64>) {
        let part = mesh.solid.fingerprint();
        let place = Some(Place { part, plate: mesh.plate, moved_mm: *moved, camera: *camera });
        if self.place == place {
            return;
        }
        self.place = place;
        self.place_idx = self.place_idx.wrapping_add(1);
        let n_corners = mesh.solid.n_corners();
        if self.corners.len() != n_corners || self.place_idx == 0 {
            self.place_idx = 1;
            let unknown = PlacedCorner { point_mm: Vector3::zeros(), pixel: None, place_idx: 0 };
            self.corners.clear();
            self.corners.resize(n_corners, unknown);
        }
    }

    /// A triangle of the prepared part.
    #[inline]
    pub(crate) fn triangle(&mut self, mesh: &Mesh, idx: u32) -> PlacedTriangle {
        let [a, b, c] = mesh.solid.corner_idx(idx);
        let (a, b, c) = (self.corner(mesh, a), self.corner(mesh, b), self.corner(mesh, c));
        PlacedTriangle { corners: [a.point_mm, b.point_mm, c.point_mm], pixels: [a.pixel, b.pixel, c.pixel] }
    }

    #[inline]
    fn corner(&mut self, mesh: &Mesh, idx: u32) -> PlacedCorner {
        let corner = &mut self.corners[idx as usize];
        if corner.place_idx != self.place_idx
            && let Some(place) = &self.place
        {
            let point_mm = place.plate.point_mm + place.moved_mm + place.plate.axes * mesh.solid.corner(idx);
            let pixel = place.camera.project(&point_mm).map(|pixel| [pixel.x, pixel.y]);
            *corner = PlacedCorner { point_mm, pixel, place_idx: self.place_idx };
        }
        *corner
    }
}
