//! A simulated station with light planes: clouds with the errors of a random calibration.

use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};
use optics::{Calibration, Camera, DepthRangeMm, LightSurfaces, Plane, StageAxis, StagePosition};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use scanning::{Cloud, CloudPoint, StagePositions};

use super::synthetic::{TABLE_POINT, table_normal};

/// Image noise along v, px.
const NOISE_PX: f64 = 0.05;

/// One σ of the camera parameters fx fy cx cy (px), of the planes (rad, rad, mm) and of the stage (mm/mm).
const FOCAL_SIGMA_PX: f64 = 0.2;
const CENTRE_SIGMA_PX: f64 = 0.1;
const TILT_SIGMA_RAD: f64 = 3e-5;
const OFFSET_SIGMA_MM: f64 = 0.008;
const STAGE_SIGMA: f64 = 1e-4;

/// The true station.
pub(crate) fn station() -> Calibration {
    let camera = Camera::from_opencv(
        1280,
        1024,
        [[2500.0, 0.0, 640.0], [0.0, 2500.0, 512.0], [0.0, 0.0, 1.0]],
        &[-0.09, 0.1, 0.0, 0.0, 0.0],
    );
    let planes = [-1i8, 0, 1]
        .map(|order| {
            let (sin, cos) = (0.42 + 0.033 * f64::from(order)).sin_cos();
            let through = Vector3::new(0.0, 13.0 * f64::from(order), 400.0);
            (order, Plane::through(&through, Vector3::new(0.0, -cos, sin)))
        })
        .to_vec();
    let sigmas: Vec<f64> =
        [FOCAL_SIGMA_PX, FOCAL_SIGMA_PX, CENTRE_SIGMA_PX, CENTRE_SIGMA_PX, 0.0, 0.0, 0.0, 0.0, 0.0]
            .into_iter()
            .chain([TILT_SIGMA_RAD, TILT_SIGMA_RAD, OFFSET_SIGMA_MM].repeat(3))
            .chain([STAGE_SIGMA; 3])
            .collect();
    Calibration {
        id: "simulated".into(),
        camera,
        orders: vec![-1, 0, 1],
        light: LightSurfaces::Planes(planes),
        stage: Some(StageAxis::new(Vector3::new(-0.005, 0.9998, -0.02)).into()),
        depth_range_mm: DepthRangeMm { near_mm: 350.0, far_mm: 450.0 },
        covariance: DMatrix::from_diagonal(&nalgebra::DVector::from(sigmas).map(|s| s * s)),
    }
}

/// Parameters of a scan.
pub(super) struct Plan {
    pub(super) n_frames: usize,
    pub(super) step_mm: f64,
    /// Distance of neighbouring points on a line.
    pub(super) pitch_mm: f64,
    /// Thickness of the light sheets, one σ: frames closer together share their noise as they share speckle.
    pub(super) sheet_sigma_mm: f64,
    /// Whether the calibration is sampled from its covariance or exact.
    pub(super) sampled: bool,
}

/// Frames far enough apart for independent noise.
const COARSE: Plan = Plan { n_frames: 40, step_mm: 0.8, pitch_mm: 0.5, sheet_sigma_mm: 0.2, sampled: true };

/// A scan by the true station, triangulated with a calibration sampled from its covariance.
pub(super) fn gauge_scan(height_mm: f64, seed: u64) -> (Cloud, Calibration) {
    planned_scan(height_mm, seed, &COARSE)
}

/// Noise of one point of a line in every frame: unit variance, with the correlation exp(−Δ²/4s²) of speckle.
fn noise_over_frames(rng: &mut Pcg64Mcg, plan: &Plan) -> Vec<f64> {
    let reach = (4.0 * plan.sheet_sigma_mm / plan.step_mm).ceil() as i32;
    let taps: Vec<f64> = (-reach..=reach)
        .map(|k| (-(f64::from(k) * plan.step_mm / plan.sheet_sigma_mm).powi(2) / 2.0).exp())
        .collect();
    let norm = taps.iter().map(|tap| tap * tap).sum::<f64>().sqrt();
    let white: Vec<f64> =
        (0..plan.n_frames + 2 * reach as usize).map(|_| rng.sample::<f64, _>(StandardNormal)).collect();
    white.windows(taps.len()).map(|near| near.iter().zip(&taps).map(|(n, t)| n * t).sum::<f64>() / norm).collect()
}

/// [`gauge_scan`] with other parameters.
pub(super) fn planned_scan(height_mm: f64, seed: u64, plan: &Plan) -> (Cloud, Calibration) {
    let truth = station();
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let size = if plan.sampled { 1.0 } else { 0.0 };
    let draw: Vec<f64> = truth
        .covariance
        .diagonal()
        .iter()
        .map(|v| size * v.sqrt() * rng.sample::<f64, _>(StandardNormal))
        .collect();
    let assumed = truth.stepped(&draw);
    let middle = (plan.n_frames - 1) as f64 / 2.0;
    let positions_mm: Vec<f64> = (0..plan.n_frames).map(|frame| (frame as f64 - middle) * plan.step_mm).collect();
    let half_columns = (30.0 / plan.pitch_mm) as i32;
    let mut points = Vec::new();
    for order in [-1, 0, 1] {
        for column in -half_columns..=half_columns {
            let noise = noise_over_frames(&mut rng, plan);
            for (frame, (&position_mm, noise)) in (0..).zip(positions_mm.iter().zip(noise)) {
                let seen = lit_pixel(&truth, order, f64::from(column) * plan.pitch_mm, position_mm, height_mm);
                let noise = Vector2::new(0.0, noise * NOISE_PX);
                points.extend(seen.and_then(|pixel| {
                    cloud_point(&assumed, order, &(pixel + noise), (frame, position_mm), plan.sampled)
                }));
            }
        }
    }
    points.sort_by_key(|point| (point.frame, point.order));
    // Neighbouring points are 3 px apart and their noise is independent.
    let mut comments = vec!["noise_correlation_px 1".to_owned(), format!("line_sigma_mm {}", plan.sheet_sigma_mm)];
    let axis = assumed.stage.and_then(|stage| stage.linear()).unwrap_or(StageAxis::new(Vector3::zeros()));
    comments.extend(StagePositions::linear(axis, positions_mm).comments());
    (Cloud { points, comments }, assumed)
}

/// The pixel of the line of `order` at `x_mm`, on top of the block if the light hits it.
fn lit_pixel(truth: &Calibration, order: i8, x_mm: f64, position_mm: f64, height_mm: f64) -> Option<Vector2<f64>> {
    let LightSurfaces::Planes(planes) = &truth.light else { return None };
    let sheet = planes.iter().find(|(candidate, _)| *candidate == order)?.1;
    let carried = truth.stage?.linear()?.direction * position_mm;
    let normal = table_normal();
    let hit_at = |height: f64| {
        let surface = TABLE_POINT + normal * height + carried;
        let rows = Matrix3::from_rows(&[sheet.normal.transpose(), normal.transpose(), Vector3::x().transpose()]);
        Some(rows.try_inverse()? * Vector3::new(-sheet.offset_mm, normal.dot(&surface), x_mm))
    };
    let top = hit_at(height_mm)?;
    let part = top - carried;
    let on_top = part.x.abs() < 11.0 && part.y.abs() < 7.0;
    let hit = if on_top { top } else { hit_at(0.0)? };
    truth.camera.project(&hit)
}

fn cloud_point(
    assumed: &Calibration,
    order: i8,
    pixel: &Vector2<f64>,
    (frame, position_mm): (u32, f64),
    sampled: bool,
) -> Option<CloudPoint> {
    let (u_px, v_px) = (pixel.x as f32, pixel.y as f32);
    let hit = assumed.triangulate(order, &Vector2::new(u_px.into(), v_px.into()), None)?;
    let part = assumed.stage?.part_from_camera(&hit.hit_in_camera, StagePosition::LinearMm(position_mm))?.xyz;
    let noise_mm = hit.noise_sigma_mm(&[0.0, 1.0], NOISE_PX);
    let systematic_mm = if sampled { assumed.systematic_sigma_mm(order, &hit)? } else { 0.0 };
    let sigma_mm = noise_mm.hypot(systematic_mm) as f32;
    let [x_mm, y_mm, z_mm] = part.into();
    Some(CloudPoint { x_mm, y_mm, z_mm, order, frame, u_px, v_px, intensity: 100.0, sigma_mm })
}
