//! Camera rays and light sheets of a station, precomputed on a coarse grid of pixels.
//!
//! Undistorting a pixel and intersecting a sheet take Newton steps; both are smooth over the image, so cubic
//! interpolation between nodes every few pixels replaces them. The sheet is stored as inverse depth, which for a plane
//! and an ideal lens is linear in the pixel.

use std::array::from_fn;

use multiversion::multiversion;
use nalgebra::{Vector2, Vector3};
use optics::{Camera, LightSurfaces};
use rayon::prelude::*;

use crate::params::MAP_STEP_PX;
use crate::render::view::block::{Block, NOTHING};
use crate::render::view::lit_pixels::WORD_PX;

/// Nodes before the first pixel, so that every pixel lies between four.
const MARGIN_NODES: usize = 1;

/// Greatest number of nodes needed for a word of a row.
const MAX_NODES: usize = WORD_PX / MAP_STEP_PX + 3;

/// Several smooth fields over the image.
#[derive(Debug, Clone)]
pub(crate) struct PixelMap<const FIELDS: usize> {
    columns: usize,
    nodes: Vec<[f64; FIELDS]>,
    /// Cubic weights of the four surrounding nodes: per node, for each position within a step.
    weights: [[f64; MAP_STEP_PX]; 4],
}

impl<const FIELDS: usize> PixelMap<FIELDS> {
    /// The map of `value`, which is NaN where the field is undefined.
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
        Self {
            columns,
            nodes,
            weights: from_fn(|node| from_fn(|idx| cubic(idx as f64 / MAP_STEP_PX as f64)[node])),
        }
    }

    /// Reads the fields at pixels (whole steps, at most a word) of row `v` from column `u`, the start of a step; the
    /// last step may extend beyond the image.
    pub(crate) fn read(&self, u: usize, v: usize, fields: [&mut [f64]; FIELDS]) {
        let first = (v / MAP_STEP_PX) * self.columns + u / MAP_STEP_PX;
        let n_nodes = fields.iter().map(|field| field.len() / MAP_STEP_PX + 3).max().unwrap_or(0);
        let rows = [0, 1, 2, 3].map(|row| &self.nodes[first + row * self.columns..][..n_nodes]);
        let mut columns = [[0.0; FIELDS]; MAX_NODES];
        let weights = self.weights.map(|weights| weights[v % MAP_STEP_PX]);
        interpolate_down(weights, rows.map(|row| row.as_flattened()), columns.as_flattened_mut());
        interpolate_along(&self.weights, &columns, fields);
    }
}

/// Interpolates the fields between four rows of nodes.
#[multiversion(targets("x86_64+avx2"))]
fn interpolate_down([a, b, c, d]: [f64; 4], [first, second, third, fourth]: [&[f64]; 4], columns: &mut [f64]) {
    let n = first.len().min(columns.len());
    let (first, second, third, fourth) = (&first[..n], &second[..n], &third[..n], &fourth[..n]);
    for (idx, column) in columns[..n].iter_mut().enumerate() {
        *column = first[idx] * a + second[idx] * b + third[idx] * c + fourth[idx] * d;
    }
}

/// Interpolates the fields along a row, between its nodes.
#[multiversion(targets("x86_64+avx2"))]
fn interpolate_along<const FIELDS: usize>(
    weights: &[[f64; MAP_STEP_PX]; 4],
    columns: &[[f64; FIELDS]; MAX_NODES],
    fields: [&mut [f64]; FIELDS],
) {
    let [a, b, c, d] = weights;
    for (idx, field) in fields.into_iter().enumerate() {
        for (four, step) in columns.array_windows::<4>().zip(field.as_chunks_mut::<MAP_STEP_PX>().0) {
            let four = four.map(|node| node[idx]);
            for at in 0..MAP_STEP_PX {
                step[at] = four[0] * a[at] + four[1] * b[at] + four[2] * c[at] + four[3] * d[at];
            }
        }
    }
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

/// The sheet of one order for every pixel.
#[derive(Debug, Clone)]
pub(crate) struct SheetMap(PixelMap<4>);

/// Intersections of the camera rays of a row segment with one sheet.
#[derive(Debug, Clone)]
pub(crate) struct SheetBlock {
    /// 1 / depth of the sheet along the ray, 1/mm.
    pub inverse_depth: Block,
    /// Normal of the sheet times ray: mm across the sheet per mm of depth.
    pub steepness: Block,
    /// Fan angle φ of the light that arrives there.
    pub phi_rad: Block,
    /// tan φ, stored because it is expensive to compute.
    pub tan_phi: Block,
}

impl SheetMap {
    pub(crate) fn new(camera: &Camera, light: &LightSurfaces, order: i8) -> Self {
        Self(PixelMap::new(camera.width_px, camera.height_px, |pixel| {
            let met = camera
                .ray_from_pixel(pixel)
                .and_then(|ray: Vector3<f64>| Some((ray, light.hit(order, &ray, None)?)));
            met.map_or([f64::NAN; 4], |(ray, hit)| {
                [1.0 / hit.depth_mm, hit.normal.dot(&ray), hit.phi_rad, hit.phi_rad.tan()]
            })
        }))
    }

    /// [`PixelMap::read`] of `n` pixels.
    pub(crate) fn read(&self, u: usize, v: usize, n: usize, sheet: &mut SheetBlock) {
        let SheetBlock { inverse_depth, steepness, phi_rad, tan_phi } = sheet;
        self.0.read(u, v, [inverse_depth, steepness, phi_rad, tan_phi].map(|field| &mut field[..n]));
    }
}

impl SheetBlock {
    /// No sheet.
    pub(crate) fn nothing() -> Self {
        Self { inverse_depth: NOTHING, steepness: NOTHING, phi_rad: NOTHING, tan_phi: NOTHING }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::shape::StationShape;
    use crate::model::station::StationModel;

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
        for &order in &model.orders {
            let (sheets, mut sheet) = (SheetMap::new(&model.camera, &light, order), SheetBlock::nothing());
            for (u, v) in (0..640).step_by(13).flat_map(|u| (0..512).step_by(11).map(move |v| (u, v))) {
                let exact = model.camera.ray_from_pixel(&Vector2::new(u as f64, v as f64)).unwrap();
                let (start, lane) = (u / MAP_STEP_PX * MAP_STEP_PX, u % MAP_STEP_PX);
                let mut rays = [NOTHING; 2];
                map.read(start, v, rays.each_mut().map(|field| &mut field[..MAP_STEP_PX]));
                let [x, y] = rays.map(|field| field[lane]);
                assert!((Vector2::new(x, y) - exact.xy()).norm() * model.camera.fx_px < RAY_TOLERANCE, "{u} {v}");
                let Some(hit) = light.hit(order, &exact, None) else { continue };
                if !(200.0..800.0).contains(&hit.depth_mm) {
                    continue;
                }
                sheets.read(start, v, MAP_STEP_PX, &mut sheet);
                let across = (1.0 / sheet.inverse_depth[lane] - hit.depth_mm) * sheet.steepness[lane];
                assert!(across.abs() < ACROSS_TOLERANCE_MM, "{order} {u} {v}: {across}");
                assert!((sheet.steepness[lane] - hit.normal.dot(&exact)).abs() < 1e-5);
                assert!((sheet.tan_phi[lane].atan() - sheet.phi_rad[lane]).abs() < 1e-7);
            }
        }
    }
}
