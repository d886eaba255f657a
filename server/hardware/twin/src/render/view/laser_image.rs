//! Laser light on a scene: the lit pixels and their levels.
//!
//! The sheet of an order has a Gaussian profile across. A pixel's light is that profile at the distance of its surface
//! point from the exact sheet, if no surface lies between the grating and the point. So the ridge lies where the true
//! sheet intersects the scene, edges and shadows fall as in reality, and only visible light is drawn.

use std::borrow::Cow;

use multiversion::multiversion;
use nalgebra::Vector3;
use optics::{Grating, Stage};

use crate::arithmetic::exp;
use crate::model::station::{StationModel, defocus};
use crate::params::{MAP_STEP_PX, SHEET_REACH_SIGMAS, WHITE_REFLECTANCE};
use crate::part::scene::{Ball, Scene, SceneHit};
use crate::render::light::sheet_map::SheetBlock;
use crate::render::renderer::Renderer;
use crate::render::sensor::FULL_SCALE;
use crate::render::view::block::{Block, NOTHING};
use crate::render::view::lit_pixels::LitPixels;
use crate::render::view::pixel_hits::{MeshMemory, PixelHits, View};

/// A scene moved by the stage: translated or rotated.
pub(crate) struct MovedScene<'s> {
    scene: Cow<'s, Scene>,
    moved_mm: Vector3<f64>,
}

/// A scene at the stage's position.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'s> {
    pub scene: &'s Scene,
    pub moved_mm: Vector3<f64>,
}

/// Light of one order.
struct OrderLight {
    grating: Grating,
    sheet_sigma_mm: f64,
    standoff_mm: f64,
    per_focus_depth_mm: f64,
    fan_half_angle_rad: f64,
    /// Level of the ridge on a white, matt surface perpendicular to the axis at the reference distance, times that
    /// distance.
    peak_mm: f64,
}

/// Light on a row segment, and its origin on the grating.
struct IncidentLight {
    level: Block,
    source: [Block; 3],
}

impl<'s> MovedScene<'s> {
    pub(crate) fn new(model: &StationModel, scene: &'s Scene, position: f64) -> Self {
        let motion = model.motion(position);
        match model.stage {
            Stage::Linear(_) => Self { scene: Cow::Borrowed(scene), moved_mm: *motion.shift_mm() },
            Stage::Rotary(_) => Self { scene: Cow::Owned(scene.turned(&motion)), moved_mm: Vector3::zeros() },
        }
    }

    pub(crate) fn placed(&self) -> Placed<'_> {
        Placed { scene: &self.scene, moved_mm: self.moved_mm }
    }
}

impl Placed<'_> {
    #[inline]
    pub(crate) fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<SceneHit> {
        self.scene.hit(&(origin - self.moved_mm), direction)
    }

    /// [`Scene::part_ball`], at the stage's position.
    pub(crate) fn part_ball(&self) -> Option<Ball> {
        let ball = self.scene.part_ball()?;
        Some(Ball { centre_mm: ball.centre_mm + self.moved_mm, ..ball })
    }

    /// [`Scene::lights`].
    #[inline]
    pub(crate) fn lights(&self, from: &Vector3<f64>, to: &Vector3<f64>, normal: &Vector3<f64>) -> bool {
        self.scene.lights(&(from - self.moved_mm), &(to - self.moved_mm), normal)
    }

    #[inline]
    pub(crate) fn reaches(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
        self.scene.reaches(&(from - self.moved_mm), &(to - self.moved_mm))
    }
}

/// Adds to `levels` (of 255, before lens blur) the laser light that every pixel receives from the scene, and to `lit`
/// the pixels that receive any; `of_order` and `memory` are scratch.
pub(crate) fn laser_light(
    renderer: &Renderer,
    scene: Placed<'_>,
    levels: &mut [f32],
    lit: &mut LitPixels,
    of_order: &mut LitPixels,
    memory: &mut MeshMemory,
) {
    for order_idx in 0..renderer.model.orders.len() {
        of_order.clear();
        let mut view = View::new(scene, memory);
        view.mark_lit(renderer, order_idx, of_order);
        view.prepare(renderer, of_order);
        light_of_order(renderer, &mut view, order_idx, of_order, levels, lit);
    }
}

/// Adds the light of one order, evaluated on the pixels of `may_be_lit`, to `levels`, and the lit pixels to `lit`.
fn light_of_order(
    renderer: &Renderer,
    view: &mut View<'_>,
    order_idx: usize,
    may_be_lit: &LitPixels,
    levels: &mut [f32],
    lit: &mut LitPixels,
) {
    let width = renderer.model.camera.width_px;
    let light = OrderLight::new(renderer, order_idx);
    let (mut hits, mut sheet) = (PixelHits::nothing(), SheetBlock::nothing());
    let mut incident = IncidentLight { level: NOTHING, source: [NOTHING; 3] };
    for (u, v, n) in may_be_lit.segments(MAP_STEP_PX) {
        view.fill_rays(renderer, u, v, n, &mut hits);
        view.cast(u, v, n, &mut hits);
        renderer.sheets[order_idx].read(u, v, n, &mut sheet);
        if !incident_light(&light, &hits, &sheet, n, &mut incident) {
            continue;
        }
        let inside = n.min(width - u);
        let bits = lit_bits(&incident.level, inside);
        if bits == 0 {
            continue;
        }
        let bits = view.lights(&incident.source, &hits, n, bits);
        add_light(&incident.level, bits, &mut levels[v * width + u..][..inside]);
        lit.add_bits(u, v, bits);
    }
}

impl OrderLight {
    fn new(renderer: &Renderer, order_idx: usize) -> Self {
        let model = &renderer.model;
        let (grating, _) = model.source_of(model.orders[order_idx]);
        let peak = model.shape.line_peak * f64::from(FULL_SCALE) / WHITE_REFLECTANCE;
        Self {
            grating,
            sheet_sigma_mm: model.sheet_sigma_mm,
            standoff_mm: model.shape.standoff_mm,
            per_focus_depth_mm: 1.0 / model.shape.focus_depth_mm,
            fan_half_angle_rad: model.fan_half_angle_rad,
            peak_mm: peak * model.order_powers[order_idx] * renderer.reference_distance_mm
                / incidence_on_plate(&grating),
        }
    }
}

/// Which of the first `n` pixels are lit, from bit 0.
#[multiversion(targets("x86_64+avx2"))]
fn lit_bits(level: &Block, n: usize) -> u64 {
    let mut bits = 0;
    for (lane, level) in level[..n].iter().enumerate() {
        bits |= u64::from(*level > 0.0) << lane;
    }
    bits
}

/// Adds the light of the pixels `bits` to a row segment.
#[multiversion(targets("x86_64+avx2"))]
fn add_light(level: &Block, bits: u64, row: &mut [f32]) {
    for (lane, (slot, level)) in row.iter_mut().zip(level).enumerate() {
        *slot += if bits >> lane & 1 == 1 { *level as f32 } else { 0.0 };
    }
}

/// The unobstructed light of one order on the surfaces of a pixel segment; 0 where there is none. Returns whether the
/// sheet reaches any of them; if not, nothing is written.
///
/// The laser's power drops at the ends of its fan as 1 − (φ/φ_max)¹⁶.
#[multiversion(targets("x86_64+avx2"))]
fn incident_light(
    light: &OrderLight,
    hits: &PixelHits,
    sheet: &SheetBlock,
    n: usize,
    incident: &mut IncidentLight,
) -> bool {
    let Grating { source_mm, axis, fan, normal, gap_mm, .. } = &light.grating;
    let [axis_incidence, fan_incidence] = [axis.dot(normal), fan.dot(normal)];
    let IncidentLight { level, source: [qx, qy, qz] } = incident;
    let PixelHits { rays: [x, y], ray_length, normal: [nx, ny, nz], reflectance, .. } = hits;
    let (mut across, mut widths, mut reached) = (NOTHING, NOTHING, false);
    for lane in 0..n.min(level.len()) {
        let width = defocus(ray_length[lane] - light.standoff_mm, light.per_focus_depth_mm);
        let sigmas = (ray_length[lane] - 1.0 / sheet.inverse_depth[lane]) * sheet.steepness[lane]
            / (light.sheet_sigma_mm * width);
        widths[lane] = width;
        reached |= sigmas.abs() <= SHEET_REACH_SIGMAS;
        across[lane] = sigmas;
    }
    if !reached {
        return false;
    }
    for lane in 0..n.min(level.len()) {
        let sigmas = across[lane];
        // Q = S + h/(k·n)·k for any length of k: a + tanφ·f.
        let (tan, phi) = (sheet.tan_phi[lane], sheet.phi_rad[lane] / light.fan_half_angle_rad);
        let to_grating = gap_mm / (axis_incidence + tan * fan_incidence);
        let source = [0, 1, 2].map(|idx| source_mm[idx] + (axis[idx] + tan * fan[idx]) * to_grating);
        let at = [x[lane] * ray_length[lane], y[lane] * ray_length[lane], ray_length[lane]];
        let dir = [at[0] - source[0], at[1] - source[1], at[2] - source[2]];
        let square = dir[0] * dir[0] + dir[1] * dir[1] + dir[2] * dir[2];
        let incidence = -(dir[0] * nx[lane] + dir[1] * ny[lane] + dir[2] * nz[lane]);
        let (phi_2, phi_4) = (phi * phi, phi * phi * phi * phi);
        let power = 1.0 - phi_4 * phi_4 * phi_4 * phi_4;
        let there = (sigmas.abs() <= SHEET_REACH_SIGMAS) & (incidence > 0.0) & (phi_2 < 1.0);
        let profile = light.peak_mm * reflectance[lane] * exp(-0.5 * sigmas * sigmas) / widths[lane];
        level[lane] = if there { profile * power * incidence / square } else { 0.0 };
        (qx[lane], qy[lane], qz[lane]) = (source[0], source[1], source[2]);
    }
    true
}

/// Cosine of incidence of the fan's axis on a plate perpendicular to the camera's axis.
fn incidence_on_plate(grating: &Grating) -> f64 {
    grating.axis.z
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use vision::LineDirection;

    use super::*;
    use crate::model::shape::{ProjectorShape, StationShape};
    use crate::model::station::StationModel;
    use crate::part::mesh::Solid;
    use crate::part::poses::board_poses;
    use crate::part::scene::SceneKind;

    /// A table on one leg and a wavy sheet of small triangles: overhangs, large triangles, seams.
    fn table_over_waves() -> Solid {
        let at = |i: usize, j: usize| {
            let (x, y) = (i as f64 - 30.0, j as f64 - 30.0);
            [x, y, 6.0 + 2.0 * (x / 5.0).sin() * (y / 7.0).cos()]
        };
        let squares = (0..60).flat_map(|i| (0..60).map(move |j| (i, j)));
        let waves = squares.flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]]
        });
        let top = [[-20.0, -8.0, 24.0], [25.0, -8.0, 27.0], [25.0, 14.0, 26.0], [-20.0, 14.0, 25.0]];
        let leg = [[0.0, 2.0, 0.0], [3.0, 2.0, 0.0], [3.0, 4.0, 26.0], [0.0, 4.0, 26.0]];
        let halves = [top, leg].into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        Solid::new(&waves.chain(halves).collect::<Vec<_>>()).unwrap()
    }

    /// All light of an image: evaluated on the traced pixels, or on every pixel with all triangles as occluders.
    fn light(renderer: &Renderer, scene: Placed<'_>, everywhere: bool) -> Vec<f32> {
        let (width, height) = (renderer.model.camera.width_px, renderer.model.camera.height_px);
        let mut levels = vec![0.0; width * height];
        let [mut lit, mut of_order] = [LitPixels::none(width, height), LitPixels::none(width, height)];
        let mut memory = MeshMemory::default();
        if !everywhere {
            laser_light(renderer, scene, &mut levels, &mut lit, &mut of_order, &mut memory);
            return levels;
        }
        of_order.add_rectangle([0.0; 2], [width as f64, height as f64], 0.0);
        for order_idx in 0..renderer.model.orders.len() {
            let mut view = View::new(scene, &mut memory);
            view.prepare(renderer, &of_order);
            light_of_order(renderer, &mut view, order_idx, &of_order, &mut levels, &mut lit);
        }
        levels
    }

    #[test]
    fn no_light_falls_on_pixels_that_are_not_evaluated() {
        let shape = StationShape { width_px: 328, height_px: 250, ..StationShape::default() };
        let columns = StationShape { line_direction: LineDirection::Columns, ..shape.clone() };
        let close =
            StationShape { field_half_width_mm: 30.0, orders: vec![-1, 0], lines_per_mm: 12.0, ..shape.clone() };
        let wide = StationShape { field_half_width_mm: 170.0, orders: vec![-4, 0, 1, 4], ..shape.clone() };
        let lasers = StationShape { projector: ProjectorShape::Lasers { lines: 2 }, ..shape.clone() };
        let table = Arc::new(table_over_waves());
        for (seed, shape) in [(3, shape), (4, columns), (5, close), (6, wide), (7, lasers)] {
            let renderer = Renderer::new(&StationModel::seeded(seed, &shape).unwrap());
            let model = renderer.model();
            let kinds = [
                SceneKind::Plate,
                SceneKind::Gauge { height_mm: 8.9 },
                SceneKind::Sphere { radius_mm: 18.9 },
                SceneKind::Freeform,
            ];
            let mut scenes: Vec<Scene> = kinds.iter().map(|kind| kind.placed(model, 1)).collect();
            scenes.extend(board_poses(model, 3).into_iter().map(Scene::Board));
            scenes.push(Scene::mesh(table.clone(), model, 1));
            for scene in &scenes {
                for position_mm in [-7.3, 4.1] {
                    let placed = MovedScene::new(renderer.model(), scene, position_mm);
                    let placed = placed.placed();
                    let (traced, all) = (light(&renderer, placed, false), light(&renderer, placed, true));
                    let n_lit = all.iter().filter(|level| **level > 0.0).count();
                    let n_other = traced.iter().zip(&all).filter(|(a, b)| a != b).count();
                    let kind = format!("{scene:?}");
                    let name = kind.split('(').next().unwrap_or_default();
                    assert!(n_lit > 2000, "{shape:?} {name}: {n_lit} pixels");
                    assert_eq!(n_other, 0, "{shape:?} {name} at {position_mm}: of {n_lit} pixels");
                }
            }
        }
    }
}
