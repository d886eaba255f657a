//! Coverage of U on a turntable: how often it contains the truth, with an uncertain axis and angles.
//!
//! Two light sheets that contain the axis, a cylinder off the axis, a bit more than a turn. Not covered: labels, and
//! surfaces found from a scan alone (`scanning`, `tests/it/turntable.rs`).

use nalgebra::{DMatrix, DVector, Vector2, Vector3};
use optics::rotation::completing_frame;
use optics::stage::AngleError;
use optics::{Calibration, Camera, DepthRangeMm, LightSurfaces, Plane, RotaryAxis, Stage, StagePosition};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use scanning::{Cloud, CloudPoint, StagePositions};

use crate::fitting::features::Search;
use crate::fitting::sample::Samples;
use crate::measuring::find::find;
use crate::measuring::systematic::Retriangulation;
use crate::*;

/// Radius of the cylinder, and the distance of its axis from the table's, mm.
const CYLINDER_MM: [f64; 2] = [16.0, 6.0];
/// Half its height.
const HALF_HEIGHT_MM: f64 = 20.0;
/// Positions of the lasers, camera frame.
const LASERS_MM: [[f64; 3]; 2] = [[-150.0, 0.0, 30.0], [140.0, 5.0, 25.0]];
/// Image noise across the lines, px.
const NOISE_PX: f64 = 0.05;
/// One σ of the axis: tilts (rad) and shifts (mm); of the angles (rad).
const AXIS_SIGMAS: [f64; 4] = [4e-4, 4e-4, 0.02, 0.02];
const ANGLE_SIGMA_RAD: f64 = 3e-4;
const STEP_DEG: f64 = 5.0;
const N_FRAMES: usize = 75;

fn axis() -> RotaryAxis {
    let axis = RotaryAxis::new(Vector3::new(0.5, 0.0, 400.0), Vector3::new(0.01, -1.0, 0.03));
    RotaryAxis { angle_error: AngleError::new(ANGLE_SIGMA_RAD), ..axis }
}

/// The true station.
fn station() -> Calibration {
    let camera = Camera::from_opencv(
        1280,
        1024,
        [[2500.0, 0.0, 640.0], [0.0, 2500.0, 512.0], [0.0, 0.0, 1.0]],
        &[-0.09, 0.1, 0.0, 0.0, 0.0],
    );
    let axis = axis();
    let sheet = |laser: [f64; 3]| axis.direction.cross(&(axis.point_mm - Vector3::from(laser))).normalize();
    let planes = LASERS_MM.map(|laser| Plane::through(&axis.point_mm, sheet(laser)));
    let sigmas: Vec<f64> = [0.2, 0.2, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0]
        .into_iter()
        .chain([3e-5, 3e-5, 0.008].repeat(2))
        .chain(AXIS_SIGMAS)
        .collect();
    Calibration {
        id: "turning".into(),
        camera,
        orders: vec![0, 1],
        light: LightSurfaces::Planes(planes.into_iter().zip(0i8..).map(|(plane, line)| (line, plane)).collect()),
        stage: Some(axis.into()),
        depth_range_mm: DepthRangeMm { near_mm: 350.0, far_mm: 450.0 },
        covariance: DMatrix::from_diagonal(&DVector::from(sigmas).map(|s| s * s)),
    }
}

/// The point of the cylinder lit by a laser at a height above the axis' point, if visible to the camera.
fn lit(truth: &RotaryAxis, laser: &Vector3<f64>, height_mm: f64, angle_rad: f64) -> Option<Vector3<f64>> {
    let up = truth.direction;
    let flat = |v: Vector3<f64>| v - up * up.dot(&v);
    let motion = truth.motion(angle_rad);
    let middle = truth.point_mm + motion.camera_direction(&(completing_frame(&up).0 * CYLINDER_MM[1]));
    // In the cross-section the sheet is a line from the laser through the axis.
    let from = flat(laser - middle);
    let way = flat(truth.point_mm - laser).normalize();
    let beside = from - way * from.dot(&way);
    let half_chord = (CYLINDER_MM[0].powi(2) - beside.norm_squared()).max(0.0).sqrt();
    let normal = (beside - way * half_chord) / CYLINDER_MM[0];
    let at = middle + normal * CYLINDER_MM[0];
    let at = at + up * (height_mm - up.dot(&(at - truth.point_mm)));
    (normal.dot(&-at) > 0.3 * at.norm()).then_some(at)
}

/// A turn by the true station, triangulated with a calibration sampled from its covariance; `axis_sampled`: whether the
/// axis and the angles are sampled, too.
fn scan(seed: u64, axis_sampled: bool) -> (Cloud, Calibration) {
    let truth = station();
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let n = truth.covariance.nrows();
    let mut draw = vec![0.0; n + optics::stage::ANGLE_NODES];
    for mode in truth.sigma_modes() {
        let size: f64 = rng.sample(StandardNormal);
        draw.iter_mut().zip(&mode).for_each(|(sum, step)| *sum += size * step);
    }
    if !axis_sampled {
        draw[n - 4..].fill(0.0);
    }
    let assumed = truth.stepped(&draw);
    let stage = assumed.stage.expect("a turntable");
    let spread = assumed.stage_uncertainty();
    let angles_deg: Vec<f64> = (0..N_FRAMES).map(|frame| frame as f64 * STEP_DEG).collect();
    let mut points = Vec::new();
    for (frame, &angle_deg) in angles_deg.iter().enumerate() {
        let position = StagePosition::RotaryDeg(angle_deg);
        for (line, laser) in (0i8..).zip(LASERS_MM) {
            for step in -20..=20 {
                let height_mm = f64::from(step) / 20.0 * HALF_HEIGHT_MM;
                let Some(at) = lit(&axis(), &laser.into(), height_mm, angle_deg.to_radians()) else { continue };
                let noise = Vector2::new(NOISE_PX * rng.sample::<f64, _>(StandardNormal), 0.0);
                let Some(pixel) = truth.camera.project(&at) else { continue };
                let (u_px, v_px) = ((pixel.x + noise.x) as f32, pixel.y as f32);
                let Some(hit) = assumed.triangulate(line, &Vector2::new(u_px.into(), v_px.into()), None) else {
                    continue;
                };
                let part = stage.part_from_camera(&hit.hit_in_camera, position).expect("an angle").xyz;
                let systematic_mm = assumed.systematic_sigma_mm(line, &hit).unwrap_or(0.0);
                let of_stage_mm = spread.in_frame(position).sigma_mm(&hit.hit_in_camera);
                let sigma_mm = hit.noise_sigma_mm(&[1.0, 0.0], NOISE_PX).hypot(systematic_mm).hypot(of_stage_mm);
                let [x_mm, y_mm, z_mm] = part.into();
                points.push(CloudPoint {
                    x_mm,
                    y_mm,
                    z_mm,
                    order: line,
                    frame: frame as u32,
                    u_px,
                    v_px,
                    intensity: 100.0,
                    sigma_mm: sigma_mm as f32,
                });
            }
        }
    }
    let positions = angles_deg.into_iter().map(StagePosition::RotaryDeg).collect();
    let mut comments = vec!["noise_correlation_px 1".to_owned(), "line_sigma_mm 0.2".to_owned()];
    comments.extend(StagePositions { stage, positions }.comments());
    (Cloud { points, comments }, assumed)
}

/// Errors of the radius over its standard uncertainty.
fn errors(seeds: u64, axis_sampled: bool, adjust: impl Fn(Calibration) -> Calibration) -> Vec<f64> {
    (0..seeds)
        .map(|seed| {
            let (cloud, calibration) = scan(seed, axis_sampled);
            let result =
                measure(&cloud, Some(&adjust(calibration)), &MeasureRequest::new(Tool::Cylinder)).unwrap();
            (result.value - CYLINDER_MM[0]) / (result.expanded_uncertainty / 2.0)
        })
        .collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Number of random turns.
const SEEDS: u64 = 30;

/// Range of the RMS of 30 standard normal values (99.8 %).
const EXPECTED_RMS: std::ops::Range<f64> = 0.62..1.4;

#[test]
fn the_truth_lies_within_u_in_about_ninety_five_of_a_hundred_turns() {
    let normalised = errors(SEEDS, true, |calibration| calibration);
    let inside = normalised.iter().filter(|error| error.abs() <= 2.0).count();
    eprintln!("{inside} of {SEEDS} inside U, normalised RMS {:.2}", rms(&normalised));
    // Fewer than 25 of 30 has a probability of 0.4 %.
    assert!(inside >= 25, "{inside} of {SEEDS}: {normalised:?}");
    assert!(EXPECTED_RMS.contains(&rms(&normalised)), "{}", rms(&normalised));
}

#[test]
fn an_uncertainty_without_the_axis_is_too_small() {
    // The axis stated as exact, with its errors still present.
    let exact = |mut calibration: Calibration| {
        let n = calibration.covariance.nrows();
        for i in n - 4..n {
            calibration.covariance[(i, i)] = 0.0;
        }
        if let Some(Stage::Rotary(axis)) = &mut calibration.stage {
            *axis = RotaryAxis { angle_error: AngleError::new(1e-9), ..*axis };
        }
        calibration
    };
    let without = rms(&errors(SEEDS, true, exact));
    eprintln!("normalised RMS {without:.2} without the axis");
    assert!(!EXPECTED_RMS.contains(&without), "{without}");
}

#[test]
fn the_sheet_at_a_point_turns_with_the_part() {
    let (cloud, calibration) = scan(1, false);
    let samples = Samples::from_cloud(&cloud, None, None);
    let mut search = Search { samples: &samples, rng: Pcg64Mcg::seed_from_u64(1) };
    let features = find(&mut search, &MeasureRequest::new(Tool::Cylinder), &mut Vec::new()).unwrap();
    let retriangulation = Retriangulation::new(&samples, &features, &calibration).unwrap();
    let pixels = retriangulation.pixels(0);
    assert!(pixels.len() > 1000, "{}", pixels.len());
    for pixel in pixels {
        // Both sheets contain the axis, at every angle.
        let from_axis =
            retriangulation.part_position(retriangulation.unperturbed(), pixel).unwrap() - axis().point_mm;
        let sine = pixel.sheet_normal.dot(&from_axis.normalize());
        assert!(sine.abs() < 0.01, "{sine}");
    }
}
