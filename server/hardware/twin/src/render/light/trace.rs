//! Finds the pixels that a sheet's light can reach: rays are traced forward, and the pixels around their ends are
//! marked.
//!
//! On a plane or a gentle hill neighbouring rays end close to each other, and a ray every few pixels suffices. Light
//! near a part's edges is traced at sub-pixel spacing.

use nalgebra::Vector3;

use crate::model::fan::{FINE_STEP_PX, Fan, FanRay};
use crate::part::mesh::Mesh;
use crate::part::mesh_corners::PlacedCorners;
use crate::part::scene::{Ball, NearHit, Plate, Scene};
use crate::render::light::band::Band;
use crate::render::light::mark::{ACROSS, COARSE, RayEnd, Section, enclose, mark_triangle};
use crate::render::renderer::Renderer;
use crate::render::view::laser_image::Placed;
use crate::render::view::lit_pixels::LitPixels;

/// Positions across the sheet as in [`ACROSS`], close to edges, where the last hit must not lie farther from the edge
/// than the margin.
const FINE_ACROSS: [f64; 9] = [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0];

/// Two hits of neighbouring rays farther apart than this lie on different surfaces, pixels.
const JUMP_PX: f64 = 48.0;

/// Margin around the ends of fine rays, pixels: more than their spacing, also where they graze the rim of a ball.
const FINE_MARGIN_PX: f64 = 4.0;

/// How far beyond the rim of a target its plane is evaluated, and how far inside the rim the light passing it, in units
/// of the rays' spacing plus the sheet's half-width: at 50° of tilt these appear 1.6 times as long.
const RIM: f64 = 4.0;

/// Width of the columns of a band, pixels at the standoff: about a fine triangle.
const CELL_PX: f64 = 4.0;

/// The sheet of one order, to be traced into a scene.
struct Tracer<'r> {
    renderer: &'r Renderer,
    fan: &'r Fan,
}

/// Marks the pixels of `lit` that light of an order may reach.
pub(crate) fn trace(
    renderer: &Renderer,
    scene: Placed<'_>,
    order_idx: usize,
    lit: &mut LitPixels,
    placed: &mut PlacedCorners,
) {
    let tracer = Tracer { renderer, fan: &renderer.fans[order_idx] };
    match scene.scene {
        Scene::Plate(plate) => tracer.follow_to_plate(plate, scene, lit),
        Scene::Gauge(gauge) => {
            tracer.follow_to_plate(&gauge.plate, scene, lit);
            tracer.follow_to_part(scene, lit);
        }
        Scene::Sphere(ball) => {
            tracer.follow_to_plate(&ball.plate, scene, lit);
            tracer.follow_to_part(scene, lit);
        }
        Scene::Mesh(mesh) => {
            tracer.follow_to_plate(&mesh.plate, scene, lit);
            tracer.follow_to_triangles(mesh, scene, lit, placed);
        }
        Scene::Board(_) => tracer.follow_to_board(scene, lit),
        Scene::Freeform(_) => tracer.follow_to_hills(scene, lit),
    }
}

impl Tracer<'_> {
    /// Distance between two [`COARSE`] rays plus the sheet's half-width.
    fn around_ray_mm(&self) -> f64 {
        self.fan.angles.spacing_mm * f64::from(COARSE) + self.fan.half_width_mm
    }

    /// Traces to the bare plate.
    fn follow_to_plate(&self, plate: &Plate, scene: Placed<'_>, lit: &mut LitPixels) {
        let plate = Plate { point_mm: plate.point_mm + scene.moved_mm, ..*plate };
        self.follow(lit, scene, |origin, direction| {
            let hit = plate.hit(origin, direction)?;
            self.landed(&(origin + direction * hit.ray_length), true)
        });
    }

    /// Traces to the target's plane within the target, and to the backdrop where light passes the target.
    fn follow_to_board(&self, scene: Placed<'_>, lit: &mut LitPixels) {
        let Scene::Board(board) = scene.scene else { return };
        let board = board.moved(&scene.moved_mm);
        let rim_mm = RIM * self.around_ray_mm();
        let edge = board.half_mm() + board.square_mm;
        let within = |origin: &Vector3<f64>, direction: &Vector3<f64>, rim_mm: f64| {
            let (ray_length, at) = board.plane_hit(origin, direction)?;
            (at.x.abs() <= edge.x + rim_mm && at.y.abs() <= edge.y + rim_mm).then_some(ray_length)
        };
        self.follow(lit, scene, |origin, direction| {
            let ray_length = within(origin, direction, rim_mm)?;
            self.landed(&(origin + direction * ray_length), true)
        });
        let backdrop_z_mm = board.backdrop_z_mm + scene.moved_mm.z;
        self.follow(lit, scene, |origin, direction| {
            if within(origin, direction, -rim_mm).is_some() {
                return None;
            }
            let ray_length = (backdrop_z_mm - origin.z) / direction.z;
            self.landed(&(origin + direction * ray_length), true)
        });
    }

    /// Traces to hills; smooth where the curvature bound proves that a ray intersects them once.
    fn follow_to_hills(&self, scene: Placed<'_>, lit: &mut LitPixels) {
        let Scene::Freeform(part) = scene.scene else { return };
        let mut beside: Option<NearHit> = None;
        self.follow(lit, scene, |origin, direction| {
            let origin = origin - scene.moved_mm;
            let near =
                beside.and_then(|near| part.hit_from(&origin, direction, near.ray_length_to(&origin, direction)));
            let hit = near.or_else(|| part.hit(&origin, direction))?;
            let point_mm = origin + direction * hit.ray_length;
            beside = Some(NearHit { point_mm, normal: hit.normal });
            self.landed(&(point_mm + scene.moved_mm), near.is_some())
        });
    }

    /// Traces light near a part, ray by ray.
    fn follow_to_part(&self, scene: Placed<'_>, lit: &mut LitPixels) {
        let Some(part) = scene.part_ball() else { return };
        // Only within this distance of the middle of the sheet can a ray of its thickness come near.
        let around = Ball { radius_mm: part.radius_mm + self.fan.half_width_mm, ..part };
        let passes = |ray: &FanRay| around.is_near(&ray.origin_mm, &ray.direction);
        let last = self.fan.angles.last;
        let close = (-last..=last).filter(|&idx| self.fan.ray(idx).is_some_and(passes));
        self.follow_closely(close, lit, |origin, direction| {
            if !part.is_near(origin, direction) {
                return None;
            }
            let hit = scene.hit(origin, direction)?;
            self.landed(&(origin + direction * hit.ray_length), false)
        });
    }

    /// Marks the triangles that touch the sheet, large ones in pieces.
    fn follow_to_triangles(
        &self,
        mesh: &Mesh,
        scene: Placed<'_>,
        lit: &mut LitPixels,
        placed: &mut PlacedCorners,
    ) {
        let Renderer { model, .. } = self.renderer;
        let Fan { order: line, angles, half_width_mm, .. } = *self.fan;
        let steps = (-angles.last..=angles.last).step_by(COARSE as usize).chain([angles.last]);
        let cell = CELL_PX * angles.step_rad / FINE_STEP_PX;
        let Some(ball) = scene.part_ball() else { return };
        let steps = steps.map(|idx| angles.phi_rad(idx));
        let (source, order) = model.source_of(line);
        let Some(band) = Band::new(&source, order, steps, half_width_mm, &ball, cell) else { return };
        placed.prepare(&model.camera, mesh, &scene.moved_mm);
        let origin = mesh.plate.point_mm + scene.moved_mm;
        let may_touch =
            |centre: &_, radius_mm: f64| band.touches_ball(&(origin + mesh.plate.axes * centre), radius_mm);
        mesh.solid.for_each_in(may_touch, |idx| {
            let triangle = placed.triangle(mesh, idx);
            let view_corners = band.corners(&triangle.corners);
            if view_corners.as_ref().is_none_or(|view_corners| band.touches(&view_corners.patch)) {
                mark_triangle(&model.camera, &band, (&triangle, view_corners.as_ref()), 0, lit);
            }
        });
    }

    /// Traces the [`COARSE`] rays to a surface, and all rays into `scene` where that is not smooth.
    fn follow(
        &self,
        lit: &mut LitPixels,
        scene: Placed<'_>,
        mut end: impl FnMut(&Vector3<f64>, &Vector3<f64>) -> Option<RayEnd>,
    ) {
        let mut previous: Option<(i32, Section)> = None;
        let last = self.fan.angles.last;
        let mut idx = -last;
        loop {
            let section = self.section(idx, ACROSS, &mut end);
            if let Some((from, before)) = previous {
                let smooth = before.iter().chain(&section).flatten().all(|landed| landed.smooth);
                if smooth {
                    enclose(&before, &section, lit);
                } else {
                    self.follow_closely(from..=idx, lit, |origin, direction| {
                        let hit = scene.hit(origin, direction)?;
                        self.landed(&(origin + direction * hit.ray_length), false)
                    });
                }
            }
            if idx == last {
                break;
            }
            previous = Some((idx, section));
            idx = (idx + COARSE).min(last);
        }
    }

    fn follow_closely(
        &self,
        angles: impl Iterator<Item = i32>,
        lit: &mut LitPixels,
        mut end: impl FnMut(&Vector3<f64>, &Vector3<f64>) -> Option<RayEnd>,
    ) {
        for idx in angles {
            let mut previous: Option<[f64; 2]> = None;
            for landed in self.section(idx, FINE_ACROSS, &mut end) {
                let pixel = landed.map(|landed| landed.pixel);
                if let Some(pixel) = pixel {
                    let near = |p: &[f64; 2]| (p[0] - pixel[0]).abs().max((p[1] - pixel[1]).abs()) < JUMP_PX;
                    lit.add_rectangle(previous.filter(near).unwrap_or(pixel), pixel, FINE_MARGIN_PX);
                }
                previous = pixel;
            }
        }
    }

    /// Traces the rays across the whole thickness of the sheet at a fan angle.
    fn section<const N: usize>(
        &self,
        idx: i32,
        places: [f64; N],
        mut end: impl FnMut(&Vector3<f64>, &Vector3<f64>) -> Option<RayEnd>,
    ) -> [Option<RayEnd>; N] {
        let Some(FanRay { origin_mm, direction, across_mm }) = self.fan.ray(idx) else { return [None; N] };
        places.map(|place| end(&(origin_mm + across_mm * place), direction))
    }

    fn landed(&self, point_mm: &Vector3<f64>, smooth: bool) -> Option<RayEnd> {
        let pixel = self.renderer.model.camera.project(point_mm)?;
        Some(RayEnd { pixel: [pixel.x, pixel.y], smooth })
    }
}
