//! A simulated station with planes of light: clouds with the errors a drawn calibration makes.

use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};
use optics::{Calibration, Camera, DepthRangeMm, LightSurfaces, Plane, StageAxis};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use scanning::{Cloud, CloudPoint};

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
pub(super) fn station() -> Calibration {
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
        stage: Some(StageAxis::new(Vector3::new(-0.005, 0.9998, -0.02))),
        depth_range_mm: DepthRangeMm { near_mm: 350.0, far_mm: 450.0 },
        covariance: DMatrix::from_diagonal(&nalgebra::DVector::from(sigmas).map(|s| s * s)),
    }
}

/// What a scan with the true station gives when it is triangulated with a calibration drawn from its covariance.
pub(super) fn gauge_scan(height_mm: f64, seed: u64) -> (Cloud, Calibration) {
    let truth = station();
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let draw: Vec<f64> =
        truth.covariance.diagonal().iter().map(|v| v.sqrt() * rng.sample::<f64, _>(StandardNormal)).collect();
    let believed = truth.stepped(&draw);
    let mut points = Vec::new();
    for frame in 0..40u32 {
        let position_mm = f64::from(frame) * 0.8 - 15.6;
        for order in [-1, 0, 1] {
            for column in -60..=60 {
                let seen = lit_pixel(&truth, order, f64::from(column) * 0.5, position_mm, height_mm);
                let noise = Vector2::new(0.0, rng.sample::<f64, _>(StandardNormal) * NOISE_PX);
                points.extend(
                    seen.and_then(|pixel| cloud_point(&believed, order, &(pixel + noise), frame, position_mm)),
                );
            }
        }
    }
    // Neighbouring points are 3 px apart and their noise is independent.
    (Cloud { points, comments: vec!["noise_correlation_px 1".into()] }, believed)
}

/// The pixel that sees the line of `order` at `x_mm`, on the block's top if that is where it falls.
fn lit_pixel(truth: &Calibration, order: i8, x_mm: f64, position_mm: f64, height_mm: f64) -> Option<Vector2<f64>> {
    let LightSurfaces::Planes(planes) = &truth.light else { return None };
    let sheet = planes.iter().find(|(candidate, _)| *candidate == order)?.1;
    let carried = truth.stage?.direction * position_mm;
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
    believed: &Calibration,
    order: i8,
    pixel: &Vector2<f64>,
    frame: u32,
    position_mm: f64,
) -> Option<CloudPoint> {
    let (u_px, v_px) = (pixel.x as f32, pixel.y as f32);
    let hit = believed.triangulate(order, &Vector2::new(u_px.into(), v_px.into()), None)?;
    let part = believed.stage?.part_from_camera(&hit.hit_in_camera, position_mm).xyz;
    let noise_mm = hit.noise_sigma_mm(&[0.0, 1.0], NOISE_PX);
    let sigma_mm = noise_mm.hypot(believed.systematic_sigma_mm(order, &hit)?) as f32;
    let [x_mm, y_mm, z_mm] = part.into();
    Some(CloudPoint { x_mm, y_mm, z_mm, order, frame, u_px, v_px, intensity: 100.0, sigma_mm })
}
