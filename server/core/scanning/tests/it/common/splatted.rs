//! Images drawn like those of `rig-b`: light splatted where the centre rays of the fan meet the scene, so bright
//! that the ground saturates, on parts of various albedos.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use optics::StagePosition;
use rayon::prelude::*;
use scanning::ScanFrame;
use twin::{Scene, SceneKind, StationModel, StationShape};
use vision::{CentrelineParams, GreyImage, Pixels, find_centrelines};

use super::rendered::{FWHM_SIGMAS, PART_STREAM, RandomNumbers, Rendered, calibration_of, wrap_mm};
use super::scene::Noise;
use super::truth_lines::{TrueRay, TruthLine, lines_between};

/// Rays of the fan, and how many of them per ray stated in the truth.
const RAYS: [usize; 2] = [7000, 12];
/// Frames, 1 mm apart.
const FRAMES: usize = 32;
/// Truncation of a splat, in standard deviations.
const SPLAT_SIGMAS: f64 = 3.5;
/// Grey level of the background, its noise, and levels² of shot noise per level.
const DARK: [f64; 3] = [3.0, 1.2, 0.025];
/// Weight of a neighbour's speckle in that of a pixel: the correlation of neighbours is 0.36, as on `rig-b`.
const SPECKLE_NEIGHBOUR_WEIGHT: f64 = 0.19;
/// Defocus at which lines are three times as wide as in focus.
const THREE_TIMES_MM: f64 = 50.0;

/// An object on the ground, in the frame of the plate (z up).
enum Body {
    Block { centre: [f64; 2], half: [f64; 2], turn_rad: f64, height: f64 },
    Ball { centre: [f64; 2], radius: f64 },
}

/// The objects on the ground with their albedos.
struct Bodies(Vec<(Body, f64)>);

impl Body {
    /// Distance along a ray to the object.
    fn hit(&self, from: &Vector3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        match self {
            Self::Ball { centre: [x, y], radius } => {
                let apart = from - Vector3::new(*x, *y, *radius);
                let (a, b) = (direction.norm_squared(), apart.dot(direction));
                let root = b * b - a * (apart.norm_squared() - radius * radius);
                (root > 0.0).then(|| (-b - root.sqrt()) / a)
            }
            Self::Block { centre, half, turn_rad, height } => {
                let (sin, cos) = turn_rad.sin_cos();
                let axes = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
                let from = axes * (from - Vector3::new(centre[0], centre[1], height / 2.0));
                let (direction, half) = (axes * direction, Vector3::new(half[0], half[1], height / 2.0));
                let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
                for axis in 0..3 {
                    let ends = [-1.0, 1.0].map(|side| (side * half[axis] - from[axis]) / direction[axis]);
                    near = near.max(ends[0].min(ends[1]));
                    far = far.min(ends[0].max(ends[1]));
                }
                (near < far).then_some(near)
            }
        }
    }
}

impl Bodies {
    /// Distance along a ray to the nearest object, and its albedo.
    fn hit(&self, from: &Vector3<f64>, direction: &Vector3<f64>) -> Option<(f64, f64)> {
        let bodies = self.0.iter().filter_map(|(thing, albedo)| Some((thing.hit(from, direction)?, *albedo)));
        let met = bodies.chain([(-from.z / direction.z, 1.0)]).filter(|(reach, _)| *reach > 0.0);
        met.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Nine blocks, a third of them exactly one wrap high, and four balls of albedos 0.2 to 1.2.
fn bodies(random: &mut RandomNumbers, wrap_mm: f64) -> Bodies {
    let place = |random: &mut RandomNumbers| [random.between(-75.0, 75.0), random.between(-45.0, 45.0)];
    let block = |idx: usize, random: &mut RandomNumbers| {
        let height = if idx < 3 { random.between(0.93, 1.07) * wrap_mm } else { random.between(2.0, 32.0) };
        let half = [random.between(6.0, 16.0), random.between(6.0, 16.0)];
        Body::Block { centre: place(random), half, turn_rad: random.between(-0.8, 0.8), height }
    };
    let mut bodies: Vec<Body> = (0..9).map(|idx| block(idx, random)).collect();
    bodies.extend((0..4).map(|_| Body::Ball { centre: place(random), radius: random.between(6.0, 18.0) }));
    Bodies(bodies.into_iter().map(|thing| (thing, random.between(0.2, 1.2))).collect())
}

/// The scene of a seed: as [`super::rendered::crowded`], 32 frames at 1 mm and lines of 5–8 px.
pub fn splatted(seed: u64) -> Rendered {
    let mut random = RandomNumbers(Noise(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x2545_F491));
    (0..8).for_each(|_| {
        random.0.uniform();
    });
    let fwhm_px = random.between(5.0, 8.0);
    let model = StationModel::seeded(seed, &StationShape::default()).unwrap();
    let calibration = calibration_of(&model);
    let wrap_mm = wrap_mm(&calibration, model.shape.standoff_mm);
    let light = Light { ridge: random.between(250.0, 400.0), speckle: random.between(0.2, 0.4), fwhm_px };
    let bodies = bodies(&mut random, wrap_mm);
    let name =
        format!("splatted {seed}: lines {fwhm_px:.1} px, ridge {:.0}, speckle {:.2}", light.ridge, light.speckle);
    let frame = |idx: usize| {
        let position_mm = idx as f64 - (FRAMES - 1) as f64 / 2.0;
        let rays = rays(&model, &bodies, position_mm);
        let image = light.image(&model, &rays, seed.wrapping_mul(1000) + idx as u64);
        let frame = ScanFrame {
            centrelines: find_centrelines(&image, &CentrelineParams::default()),
            position: StagePosition::LinearMm(position_mm),
        };
        let stated: Vec<TrueRay> =
            rays.iter().filter(|(idx, ..)| idx.is_multiple_of(RAYS[1])).map(|(_, ray, _)| *ray).collect();
        (frame, lines_between(&stated, model.camera.width_px))
    };
    let (frames, truth): (Vec<ScanFrame>, Vec<Vec<TruthLine>>) = (0..FRAMES).into_par_iter().map(frame).unzip();
    Rendered { name, calibration, frames, truth }
}

/// The rays that reach a visible point, by order, then along the fan: index, position, brightness.
fn rays(model: &StationModel, bodies: &Bodies, position_mm: f64) -> Vec<(usize, TrueRay, f64)> {
    let Scene::Plate(plate) = SceneKind::Plate.placed(model, PART_STREAM) else {
        unreachable!("the scene is a plate")
    };
    let origin = plate.point_mm + model.stage.linear().unwrap().direction * position_mm;
    let to_plate = plate.axes.transpose();
    let eye = -(to_plate * origin);
    let of_order = |(order, power): (&i8, &f64)| {
        let of_ray = |idx: usize| {
            let phi = model.fan_half_angle_rad * (2.0 * (idx as f64 + 0.5) / RAYS[0] as f64 - 1.0);
            let ray = model.grating.ray(phi, *order)?;
            let (from, direction) = (to_plate * (ray.origin_mm - origin), to_plate * ray.direction);
            let (reach, albedo) = bodies.hit(&from, &direction)?;
            let there = from + direction * reach;
            let (seen, _) = bodies.hit(&eye, &(there - eye))?;
            let at = ray.origin_mm + ray.direction * reach;
            let pixel = model.camera.project(&at).filter(|_| seen > 1.0 - 1e-6)?;
            let ray = TrueRay { order: *order, along_px: pixel.x, across_px: pixel.y, depth_mm: at.z };
            Some((idx, ray, albedo * power))
        };
        (0..RAYS[0]).filter_map(of_ray).collect::<Vec<_>>()
    };
    model.orders.iter().zip(&model.order_powers).flat_map(of_order).collect()
}

/// Appearance of the lines.
struct Light {
    /// Grey levels of the brightest line's ridge on the ground, without saturation.
    ridge: f64,
    /// Contrast of the speckle.
    speckle: f64,
    fwhm_px: f64,
}

impl Light {
    fn image(&self, model: &StationModel, rays: &[(usize, TrueRay, f64)], seed: u64) -> GreyImage {
        let (width, height) = (model.camera.width_px, model.camera.height_px);
        let mut levels = vec![0.0f32; width * height];
        let spacing_px = 2.0 * model.fan_half_angle_rad * model.camera.fx_px / RAYS[0] as f64;
        for (_, ray, brightness) in rays {
            let out_of_focus = (ray.depth_mm - model.shape.standoff_mm) / THREE_TIMES_MM;
            let widened = (1.0 + 8.0 * out_of_focus * out_of_focus).sqrt();
            let sigma_px = self.fwhm_px / FWHM_SIGMAS * widened;
            // Splats of one line sum to its ridge; wider ones are dimmer.
            let peak = self.ridge * brightness * spacing_px / ((2.0 * PI).sqrt() * sigma_px * widened);
            let profile = |centre: f64, limit: usize| -> (usize, Vec<f32>) {
                let first = (centre - SPLAT_SIGMAS * sigma_px).ceil().max(0.0) as usize;
                let last = ((centre + SPLAT_SIGMAS * sigma_px).floor().max(-1.0) + 1.0) as usize;
                let at = |px: usize| (-0.5 * ((px as f64 - centre) / sigma_px).powi(2)).exp() as f32;
                (first, (first..last.min(limit)).map(at).collect())
            };
            let ((u, across_u), (v, across_v)) = (profile(ray.along_px, width), profile(ray.across_px, height));
            for (row, of_row) in across_v.iter().enumerate() {
                let share = peak as f32 * of_row;
                let slots = levels[(v + row) * width..].iter_mut().skip(u);
                slots.zip(&across_u).for_each(|(slot, of_column)| *slot += share * of_column);
            }
        }
        let mut noise = Noise(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x1357_9BDF);
        (0..8).for_each(|_| {
            noise.uniform();
        });
        let speckle = self.speckle_field(width, height, &mut noise);
        let pixel = |(level, speckle): (&f32, &f32)| {
            let level = f64::from(level * speckle);
            let sigma = (DARK[1] * DARK[1] + DARK[2] * level).sqrt();
            (DARK[0] + level + sigma * noise.next()).round().clamp(0.0, 255.0) as u8
        };
        let grey = levels.iter().zip(&speckle).map(pixel).collect();
        GreyImage::new(width, height, Pixels::Eight(grey)).unwrap()
    }

    /// Factors about 1, correlated between neighbouring pixels.
    fn speckle_field(&self, width: usize, height: usize, noise: &mut Noise) -> Vec<f32> {
        let raw: Vec<f32> = (0..width * height).map(|_| noise.next() as f32).collect();
        let blurred = |values: &[f32], step: usize| -> Vec<f32> {
            let share = SPECKLE_NEIGHBOUR_WEIGHT as f32;
            let norm = (1.0 + 2.0 * share * share).sqrt();
            let at = |idx: usize| {
                let beside =
                    values.get(idx.wrapping_sub(step)).unwrap_or(&0.0) + values.get(idx + step).unwrap_or(&0.0);
                (values[idx] + share * beside) / norm
            };
            (0..values.len()).map(at).collect()
        };
        let variance = (1.0 + self.speckle * self.speckle).ln() as f32;
        let field = blurred(&blurred(&raw, 1), width);
        field.into_iter().map(|normal| (normal * variance.sqrt() - 0.5 * variance).exp()).collect()
    }
}
