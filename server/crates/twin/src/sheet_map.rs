//! Camera rays and light sheets of a station, precomputed on a coarse grid of pixels.
//!
//! Undistorting a pixel and meeting a sheet take Newton steps; both are smooth over the picture, so a cubic
//! through nodes every few pixels replaces them. The sheet is kept as inverse depth, which for a plane and an
//! ideal lens is linear in the pixel.

use nalgebra::{Vector2, Vector3};
use optics::{Camera, LightSurfaces};
use rayon::prelude::*;

use crate::params::MAP_STEP_PX;

/// Nodes before the first pixel, so that every pixel lies between four.
const MARGIN_NODES: usize = 1;

/// Several smooth fields over the picture.
#[derive(Debug, Clone)]
pub(crate) struct PixelMap<const FIELDS: usize> {
    columns: usize,
    nodes: Vec<[f64; FIELDS]>,
    /// Cubic weights of the four nodes around each position within a step.
    weights: [[f64; 4]; MAP_STEP_PX],
}

impl<const FIELDS: usize> PixelMap<FIELDS> {
    /// The map of `value`, which is NaN where the field does not exist.
    pub(crate) fn new(
        width_px: usize,
        height_px: usize,
        value: impl Fn(&Vector2<f64>) -> [f64; FIELDS] + Sync,
    ) -> Self {
        let columns = nodes_for(width_px);
        let at = |idx: usize| (idx as f64 - MARGIN_NODES as f64) * MAP_STEP_PX as f64;
        let nodes = (0..nodes_for(height_px) * columns)
            .into_par_iter()
            .map(|idx| value(&Vector2::new(at(idx % columns), at(idx / columns))))
            .collect();
        Self { columns, nodes, weights: std::array::from_fn(|idx| cubic(idx as f64 / MAP_STEP_PX as f64)) }
    }

    /// A reader that is quick where pixels follow each other along a row.
    pub(crate) fn walk(&self) -> Walk<'_, FIELDS> {
        Walk { map: self, place: None, columns: [[0.0; FIELDS]; 4] }
    }
}

/// Reads a map pixel by pixel and keeps what neighbours in a row share: the four node columns, interpolated to it.
#[derive(Debug, Clone)]
pub(crate) struct Walk<'m, const FIELDS: usize> {
    map: &'m PixelMap<FIELDS>,
    /// Step of columns, and row, of what is kept.
    place: Option<(usize, usize)>,
    columns: [[f64; FIELDS]; 4],
}

impl<const FIELDS: usize> Walk<'_, FIELDS> {
    /// The fields at a pixel inside the picture.
    #[inline]
    pub(crate) fn at(&mut self, u: usize, v: usize) -> [f64; FIELDS] {
        let place = Some((u / MAP_STEP_PX, v));
        if self.place != place {
            self.place = place;
            self.columns = self.interpolated_columns(u / MAP_STEP_PX, v);
        }
        weighted_sum(&self.map.weights[u % MAP_STEP_PX], &self.columns)
    }

    fn interpolated_columns(&self, step: usize, v: usize) -> [[f64; FIELDS]; 4] {
        let first = (v / MAP_STEP_PX) * self.map.columns + step;
        let mut columns = [[0.0; FIELDS]; 4];
        for (node, column) in columns.iter_mut().enumerate() {
            let mut four = [[0.0; FIELDS]; 4];
            for (row, slot) in four.iter_mut().enumerate() {
                *slot = self.map.nodes[first + row * self.map.columns + node];
            }
            *column = weighted_sum(&self.map.weights[v % MAP_STEP_PX], &four);
        }
        columns
    }
}

#[inline]
fn weighted_sum<const FIELDS: usize>(weights: &[f64; 4], nodes: &[[f64; FIELDS]; 4]) -> [f64; FIELDS] {
    let mut sum = [0.0; FIELDS];
    for (node, weight) in nodes.iter().zip(weights) {
        for (slot, value) in sum.iter_mut().zip(node) {
            *slot += weight * value;
        }
    }
    sum
}

fn nodes_for(size_px: usize) -> usize {
    (size_px - 1) / MAP_STEP_PX + 4
}

/// Weights of the cubic through nodes at −1, 0, 1, 2 (Lagrange).
fn cubic(x: f64) -> [f64; 4] {
    [
        -x * (x - 1.0) * (x - 2.0) / 6.0,
        (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
        -(x + 1.0) * x * (x - 2.0) / 2.0,
        (x + 1.0) * x * (x - 1.0) / 6.0,
    ]
}

/// (x_h, y_h) of every pixel's ray.
pub(crate) fn ray_map(camera: &Camera) -> PixelMap<2> {
    PixelMap::new(camera.width_px, camera.height_px, |pixel| {
        camera.ray_from_pixel(pixel).map_or([f64::NAN; 2], |ray| [ray.x, ray.y])
    })
}

/// What a camera ray meets of one sheet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SheetAt {
    /// 1 / depth of the sheet along the ray, 1/mm.
    pub inverse_depth: f64,
    /// Normal of the sheet times ray: mm across the sheet per mm of depth.
    pub steepness: f64,
    /// Fan angle of the light that arrives there.
    pub phi_rad: f64,
}

/// The sheet of one order as every pixel sees it.
#[derive(Debug, Clone)]
pub(crate) struct SheetMap(PixelMap<3>);

impl SheetMap {
    pub(crate) fn new(camera: &Camera, light: &LightSurfaces, order: i8) -> Self {
        Self(PixelMap::new(camera.width_px, camera.height_px, |pixel| {
            let met = camera
                .ray_from_pixel(pixel)
                .and_then(|ray: Vector3<f64>| Some((ray, light.hit(order, &ray, None)?)));
            met.map_or([f64::NAN; 3], |(ray, hit)| [1.0 / hit.depth_mm, hit.normal.dot(&ray), hit.phi_rad])
        }))
    }

    pub(crate) fn walk(&self) -> SheetWalk<'_> {
        SheetWalk(self.0.walk())
    }
}

/// Reads the sheet of one order pixel by pixel.
#[derive(Debug, Clone)]
pub(crate) struct SheetWalk<'m>(Walk<'m, 3>);

impl SheetWalk<'_> {
    #[inline]
    pub(crate) fn at(&mut self, u: usize, v: usize) -> SheetAt {
        let [inverse_depth, steepness, phi_rad] = self.0.at(u, v);
        SheetAt { inverse_depth, steepness, phi_rad }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::StationShape;
    use crate::station::StationModel;

    #[test]
    fn interpolated_sheets_match_exact_ones() {
        // 1e-4 px of ray, and of sheet: 2e-5 mm across at 0.2 mm/px.
        const RAY_TOLERANCE: f64 = 1e-4;
        const ACROSS_TOLERANCE_MM: f64 = 2e-5;
        let orders = vec![-4, 0, 4];
        let shape = StationShape {
            width_px: 640,
            height_px: 512,
            field_half_width_mm: 170.0,
            orders,
            ..Default::default()
        };
        let model = StationModel::seeded(9, &shape).unwrap();
        let (map, light) = (ray_map(&model.camera), LightSurfaces::Grating(model.grating));
        let mut rays = map.walk();
        for &order in &model.orders {
            let map = SheetMap::new(&model.camera, &light, order);
            let mut sheets = map.walk();
            for (u, v) in (0..640).step_by(13).flat_map(|u| (0..512).step_by(11).map(move |v| (u, v))) {
                let exact = model.camera.ray_from_pixel(&Vector2::new(u as f64, v as f64)).unwrap();
                let [x, y] = rays.at(u, v);
                assert!((Vector2::new(x, y) - exact.xy()).norm() * model.camera.fx_px < RAY_TOLERANCE, "{u} {v}");
                let Some(hit) = light.hit(order, &exact, None) else { continue };
                if !(200.0..800.0).contains(&hit.depth_mm) {
                    continue;
                }
                let sheet = sheets.at(u, v);
                let across = (1.0 / sheet.inverse_depth - hit.depth_mm) * sheet.steepness;
                assert!(across.abs() < ACROSS_TOLERANCE_MM, "{order} {u} {v}: {across}");
                assert!((sheet.steepness - hit.normal.dot(&exact)).abs() < 1e-5);
            }
        }
    }
}
