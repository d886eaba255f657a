//! Laser light on a scene: which pixels see it, and how much.
//!
//! The sheet of an order has a Gaussian profile across. A pixel's light is that profile at the distance of the
//! seen surface point from the exact sheet, if no surface stands between the grating and the point. So the
//! ridge lies where the true sheet meets the scene, edges and shadows fall where they do in nature, and no
//! light is drawn that a camera could not see.

use nalgebra::Vector3;
use optics::{Grating, LightRay};

use crate::lit_pixels::LitPixels;
use crate::params::{SHEET_REACH_SIGMAS, WHITE_REFLECTANCE};
use crate::renderer::Renderer;
use crate::scene::{NearHit, Scene, SceneHit};
use crate::sensor::FULL_SCALE;
use crate::sheet_map::SheetAt;

/// Places across the sheet, in units of its reach, whose hits show where light falls.
const ACROSS: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// Fan angle between two traced rays, in pixels at the standoff.
const TRACE_STEP_PX: f64 = 0.9;

/// Two hits of neighbouring rays farther apart than this lie on different surfaces, pixels.
const JUMP_PX: f64 = 48.0;

/// Added around what the traced rays show, pixels; more than their spacing.
const TRACE_MARGIN_PX: f64 = 2.0;

/// How fast the laser's power drops at the ends of its fan: 1 − (φ/φ_max)^16.
const FAN_EDGE_POWER: i32 = 16;

/// A scene where the stage has carried it.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'s> {
    pub scene: &'s Scene,
    pub moved_mm: Vector3<f64>,
}

impl Placed<'_> {
    #[inline]
    pub(crate) fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<SceneHit> {
        self.scene.hit(&(origin - self.moved_mm), direction)
    }

    /// [`Scene::hit_near`]; `near` is where the stage has carried it.
    #[inline]
    pub(crate) fn hit_near(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        near: Option<&NearHit>,
    ) -> Option<SceneHit> {
        let at_rest = near.map(|near| NearHit { point_mm: near.point_mm - self.moved_mm, normal: near.normal });
        self.scene.hit_near(&(origin - self.moved_mm), direction, at_rest.as_ref())
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
/// the pixels it may fall on; `of_order` is scratch.
pub(crate) fn laser_light(
    renderer: &Renderer,
    scene: Placed<'_>,
    levels: &mut [f32],
    lit: &mut LitPixels,
    of_order: &mut LitPixels,
) {
    let width = renderer.model.camera.width_px;
    for order_idx in 0..renderer.model.orders.len() {
        of_order.clear();
        trace(renderer, scene, order_idx, of_order);
        let (mut rays, mut sheet) = (renderer.rays.walk(), renderer.sheets[order_idx].walk());
        let mut near = None;
        for (u, v) in of_order.pixels() {
            let [x, y] = rays.at(u, v);
            let ray = Vector3::new(x, y, 1.0);
            let Some(hit) = scene.hit_near(&Vector3::zeros(), &ray, near.as_ref()) else { continue };
            near = Some(NearHit { point_mm: ray * hit.reach, normal: hit.normal });
            if let Some(level) = pixel_level(renderer, scene, order_idx, &ray, &hit, &sheet.at(u, v)) {
                levels[v * width + u] += level;
            }
        }
        lit.add(of_order);
    }
}

/// The fan angles at which a sheet is traced: closer than pixels.
pub(crate) fn traced_angles(renderer: &Renderer) -> impl Iterator<Item = f64> + use<> {
    let model = &renderer.model;
    let step = TRACE_STEP_PX / model.camera.fx_px.max(model.camera.fy_px) * model.shape.standoff_mm
        / renderer.reference_distance_mm;
    let n = (model.fan_half_angle_rad / step).ceil() as i32;
    (-n..=n).map(move |idx| f64::from(idx) * step)
}

/// Follows rays of the whole thickness of the sheet and marks the pixels around where they land.
fn trace(renderer: &Renderer, scene: Placed<'_>, order_idx: usize, lit: &mut LitPixels) {
    let model = &renderer.model;
    let reach_mm = SHEET_REACH_SIGMAS * model.sheet_sigma_mm;
    let mut beside = None;
    for phi in traced_angles(renderer) {
        let Some(ray) = model.grating.ray(phi, model.orders[order_idx]) else { continue };
        let across = ray.direction.cross(&model.grating.fan).normalize();
        let mut previous: Option<[f64; 2]> = None;
        for place in ACROSS {
            let origin = ray.origin_mm + across * (place * reach_mm);
            let landed = scene.hit_near(&origin, &ray.direction, beside.as_ref()).and_then(|hit| {
                let point_mm = origin + ray.direction * hit.reach;
                beside = Some(NearHit { point_mm, normal: hit.normal });
                let pixel = model.camera.project(&point_mm)?;
                Some([pixel.x, pixel.y])
            });
            if let Some(pixel) = landed {
                let near = |p: &[f64; 2]| (p[0] - pixel[0]).abs().max((p[1] - pixel[1]).abs()) < JUMP_PX;
                lit.add_rectangle(previous.filter(near).unwrap_or(pixel), pixel, TRACE_MARGIN_PX);
            }
            previous = landed;
        }
    }
}

/// The light of one order on the surface that a pixel sees; `None` if there is none.
#[inline]
fn pixel_level(
    renderer: &Renderer,
    scene: Placed<'_>,
    order_idx: usize,
    ray: &Vector3<f64>,
    hit: &SceneHit,
    sheet: &SheetAt,
) -> Option<f32> {
    let model = &renderer.model;
    let across_mm = (hit.reach - 1.0 / sheet.inverse_depth) * sheet.steepness;
    let sigmas = across_mm / model.sheet_sigma_mm;
    if sigmas.is_nan() || sigmas.abs() > SHEET_REACH_SIGMAS {
        return None;
    }
    let light = model.grating.ray(sheet.phi_rad, model.orders[order_idx])?;
    let point = ray * hit.reach;
    let share = light_share(renderer, scene, &light, &point, hit, sheet.phi_rad)?;
    let profile = (-0.5 * sigmas * sigmas).exp();
    let peak = model.shape.line_peak * f64::from(FULL_SCALE) / WHITE_REFLECTANCE;
    Some((peak * model.order_powers[order_idx] * hit.reflectance * profile * share) as f32)
}

/// Light on a surface element against a white one across the axis at the reference distance; `None` in shadow.
fn light_share(
    renderer: &Renderer,
    scene: Placed<'_>,
    light: &LightRay,
    point: &Vector3<f64>,
    hit: &SceneHit,
    phi_rad: f64,
) -> Option<f64> {
    let way = point - light.origin_mm;
    let length = way.norm();
    let incidence = -way.dot(&hit.normal) / length;
    let fan = 1.0 - (phi_rad / renderer.model.fan_half_angle_rad).powi(FAN_EDGE_POWER);
    if incidence <= 0.0 || fan <= 0.0 || !scene.lights(&light.origin_mm, point, &hit.normal) {
        return None;
    }
    Some(fan * incidence / incidence_on_plate(&renderer.model.grating) * renderer.reference_distance_mm / length)
}

/// Cosine of incidence of the fan's axis on a plate across the camera's axis.
fn incidence_on_plate(grating: &Grating) -> f64 {
    grating.axis.z
}
