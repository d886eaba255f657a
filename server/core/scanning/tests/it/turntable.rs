//! A part that turns through 360° under a camera with a known axis: labels, points and closure compared with its true
//! surface. The lines are modelled with white noise; the extraction of lines is not covered.

use std::sync::LazyLock;

use nalgebra::{DMatrix, Vector2, Vector3};
use optics::{Calibration, Camera, DepthRangeMm, LightSurfaces, Plane, RotaryAxis, StageAxis, StagePosition};
use remedy::Remedy as _;
use scanning::{
    CloudPoint, MeshParams, ScanError, ScanParams, ScanResult, StagePositions, mesh_from_cloud, scan_cloud,
};

use crate::common::scene::{grating_light, scan, scan_moved};
use crate::common::{KnownScan, assert_labelled, station};

/// Angle between two frames: 1.2 mm at the part's radius, about the step of other scans.
const STEP_DEG: f64 = 3.0;
/// Steep flanks are short on every line and are rejected where only one order observed them.
const RECOVERED: f64 = 0.93;
/// 5 σ of a point (0.05 px of noise are 20 µm at this station's angle) on slopes up to 45°.
const OFF_SURFACE_MM: f64 = 0.15;
/// Accepted fraction of points farther off: single ones at edges.
const ASTRAY: f64 = 0.001;
/// Half the part's height, mm.
const HALF_HEIGHT_MM: f64 = 22.0;

pub(crate) fn axis() -> RotaryAxis {
    RotaryAxis::new(Vector3::new(1.0, 2.0, 404.0), Vector3::new(0.02, -1.0, 0.1))
}

/// Radius of the part at an azimuth and height about the axis.
fn radius_mm(turn_rad: f64, height_mm: f64) -> f64 {
    21.0 + 2.0 * (3.0 * turn_rad).cos() + 0.8 * (5.0 * turn_rad + height_mm / 9.0).sin()
}

/// Azimuth, height and radius of a point of the part frame.
pub(crate) fn about_axis(at: &Vector3<f64>) -> (f64, f64, f64) {
    static FRAME: LazyLock<(Vector3<f64>, [Vector3<f64>; 3])> = LazyLock::new(|| {
        let (first, second) = optics::rotation::completing_frame(&axis().direction);
        (axis().point_mm, [first, second, axis().direction])
    });
    let from_axis = at - FRAME.0;
    let [x, y, height] = FRAME.1.map(|way| way.dot(&from_axis));
    (y.atan2(x), height, x.hypot(y))
}

pub(crate) fn solid(at: &Vector3<f64>) -> f64 {
    let (turn_rad, height_mm, radius) = about_axis(at);
    if height_mm.abs() > HALF_HEIGHT_MM { -1.0 } else { radius_mm(turn_rad, height_mm) - radius }
}

pub(crate) fn angles(from_deg: f64, to_deg: f64) -> Vec<StagePosition> {
    let n = ((to_deg - from_deg) / STEP_DEG).round() as usize;
    (0..=n).map(|idx| StagePosition::RotaryDeg(from_deg + idx as f64 * STEP_DEG)).collect()
}

/// The standard test station with its lines along columns, in front of a turntable.
fn grating_station() -> Calibration {
    let n_parameters = 9 + 10 + 4;
    Calibration {
        stage: Some(axis().into()),
        covariance: DMatrix::from_diagonal_element(n_parameters, n_parameters, 1e-12),
        ..station(5, true)
    }
}

fn grating_scan(positions: &[StagePosition]) -> (Calibration, KnownScan) {
    let station = grating_station();
    let LightSurfaces::Grating(grating) = &station.light else { panic!("it has a grating") };
    let light = grating_light(grating);
    let known = scan_moved(&station, &solid, &light, positions);
    (station, known)
}

/// Positions of the two lasers of a hobby rig.
const LASERS_MM: [[f64; 3]; 2] = [[-170.0, 0.0, 30.0], [150.0, 10.0, 40.0]];

/// Two lasers, left and right of the camera, whose sheets contain the axis.
pub(crate) fn two_lasers() -> Calibration {
    let along = axis().direction;
    let sheet = |laser: [f64; 3]| {
        let source = Vector3::from(laser);
        Plane::through(&source, along.cross(&(axis().point_mm - source)).normalize())
    };
    // The sheet from the left lights the left of the part: it is the first line.
    let planes = vec![(0, sheet(LASERS_MM[0])), (1, sheet(LASERS_MM[1]))];
    let n_parameters = 9 + 6 + 4;
    Calibration {
        id: "hobby".into(),
        camera: Camera::from_opencv(512, 640, [[1260.0, 0.0, 256.0], [0.0, 1259.0, 320.0], [0.0, 0.0, 1.0]], &[]),
        orders: vec![0, 1],
        light: LightSurfaces::Planes(planes),
        stage: Some(axis().into()),
        depth_range_mm: DepthRangeMm { near_mm: 360.0, far_mm: 440.0 },
        covariance: DMatrix::from_diagonal_element(n_parameters, n_parameters, 1e-12),
    }
}

/// Rays of a laser within its sheet.
pub(crate) fn laser_light(order: i8, phi_rad: f64) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let source = Vector3::from(LASERS_MM[order as usize]);
    let middle = (axis().point_mm - source).normalize();
    let along = axis().direction - middle * middle.dot(&axis().direction);
    // Downwards in the image, against the axis.
    Some((source, middle * phi_rad.cos() - along.normalize() * phi_rad.sin()))
}

fn place(point: &CloudPoint) -> Vector3<f64> {
    Vector3::new(point.x_mm, point.y_mm, point.z_mm)
}

/// Distance of every point from the true surface, approximately along its normal (radial distance over slope).
fn off_surface_mm(result: &ScanResult) -> Vec<f64> {
    let off = |point: &CloudPoint| {
        let (turn_rad, height_mm, radius) = about_axis(&place(point));
        let expected = radius_mm(turn_rad, height_mm);
        let slope =
            (radius_mm(turn_rad + 1e-4, height_mm) - radius_mm(turn_rad - 1e-4, height_mm)) / 2e-4 / expected;
        (radius - expected) / slope.hypot(1.0)
    };
    result.cloud.points.iter().map(off).collect()
}

fn assert_on_surface(result: &ScanResult) {
    let off = off_surface_mm(result);
    let astray = off.iter().filter(|off| off.abs() > OFF_SURFACE_MM).count() as f64 / off.len() as f64;
    let rms = (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
    eprintln!(
        "  {} points, RMS {:.1} µm from the true surface, astray {:.4} %",
        off.len(),
        1e3 * rms,
        100.0 * astray
    );
    assert!(astray <= ASTRAY, "{astray}");
    // All around: every sector of 10° has points.
    let mut sectors = [0; 36];
    for point in &result.cloud.points {
        let turns = about_axis(&place(point)).0 / std::f64::consts::TAU;
        sectors[(turns.rem_euclid(1.0) * 36.0) as usize % 36] += 1;
    }
    let least = sectors.iter().min().unwrap();
    assert!(*least as f64 > 0.3 * off.len() as f64 / 36.0, "{sectors:?}");
}

#[test]
fn a_part_turned_through_a_circle_is_labelled_and_lies_on_its_true_surface() {
    let (station, known) = grating_scan(&angles(0.0, 375.0));
    let result = assert_labelled("turned part, grating", &known, &station, RECOVERED);
    assert_on_surface(&result);
    let closure = result.report.closure.unwrap();
    for gap in [closure.same_line.unwrap(), closure.other_lines.unwrap()] {
        eprintln!("  {gap:?}");
        // White noise of two points, less than 30 µm each.
        assert!(gap.n_pairs > 100 && gap.bias_mm.abs() < 0.01 && gap.rms_mm < 0.06, "{gap:?}");
    }
    assert!(StagePositions::from_comments(&result.cloud.comments).unwrap().stage.rotary().is_some());
}

#[test]
fn two_lasers_and_a_turntable_make_a_whole_part_and_a_mesh_that_faces_outwards() {
    let station = two_lasers();
    let known = scan_moved(&station, &solid, &laser_light, &angles(-180.0, 195.0));
    let result = assert_labelled("turned part, two lasers", &known, &station, RECOVERED);
    assert_on_surface(&result);
    let mesh = mesh_from_cloud(&result.cloud, &MeshParams::default());
    let outwards = |triangle: &&[u32; 3]| {
        let middle =
            triangle.iter().map(|&idx| Vector3::from(mesh.vertices_mm[idx as usize])).sum::<Vector3<f64>>();
        let from_axis = middle / 3.0 - axis().point_mm;
        let radial = from_axis - axis().direction * axis().direction.dot(&from_axis);
        Vector3::from(mesh.triangle_normal(triangle)).dot(&radial) > 0.0
    };
    let share = mesh.triangles.iter().filter(outwards).count() as f64 / mesh.triangles.len() as f64;
    assert!(mesh.triangles.len() > 1000 && share > 0.99, "{share} of {}", mesh.triangles.len());
}

/// Mean azimuth of a line, where 0 faces the camera.
fn azimuths_rad(known: &KnownScan, station: &Calibration) -> Vec<f64> {
    let towards_camera = about_axis(&Vector3::zeros()).0;
    let of_order = |&order: &i8| {
        let (mut sum, mut n) = (0.0, 0.0);
        for (frame, orders) in known.frames.iter().zip(&known.orders) {
            for (segment, orders) in frame.centrelines.segments.iter().zip(orders) {
                for (point, _) in segment.points.iter().zip(orders).filter(|(_, label)| **label == Some(order)) {
                    let pixel = Vector2::new(point.u_px, point.v_px);
                    let Some(hit) = station.triangulate(order, &pixel, None) else { continue };
                    sum += about_axis(&hit.hit_in_camera.xyz).0 - towards_camera;
                    n += 1.0;
                }
            }
        }
        sum / n
    };
    station.orders.iter().map(of_order).collect()
}

#[test]
fn an_axis_error_shows_in_the_closure_of_other_lines_and_not_of_the_same_line() {
    let station = two_lasers();
    let known = scan_moved(&station, &solid, &laser_light, &angles(0.0, 390.0));
    let azimuths = azimuths_rad(&known, &station);
    // Across the view, perpendicular to the direction from the axis to the camera: δ·(e_r(φ₁) − e_r(φ₂)), eq. 11.
    let towards = -(axis().point_mm - axis().direction * axis().direction.dot(&axis().point_mm)).normalize();
    let sideways = axis().direction.cross(&towards);
    let mut biases = Vec::new();
    for error_mm in [0.0, 0.1, 0.2] {
        let wrong = RotaryAxis { point_mm: axis().point_mm + sideways * error_mm, ..axis() };
        let assumed = Calibration { stage: Some(wrong.into()), ..station.clone() };
        let result = scan_cloud(&known.frames, &assumed, &ScanParams::default()).unwrap();
        let closure = result.report.closure.unwrap();
        let (same, other) = (closure.same_line.unwrap(), closure.other_lines.unwrap());
        let expected_mm = error_mm * (azimuths[0].sin() - azimuths[1].sin()).abs();
        eprintln!("{error_mm} mm: same {same:?}\n  other {other:?}, expected RMS {expected_mm}");
        assert!(same.rms_mm < 0.06, "{same:?}");
        biases.push((other.rms_mm, expected_mm));
    }
    let noise_mm = biases[0].0;
    for (rms_mm, expected_mm) in &biases[1..] {
        // Slopes of the part turn the normal away from the radius: a quarter.
        let of_error_mm = (rms_mm * rms_mm - noise_mm * noise_mm).sqrt();
        assert!((of_error_mm / expected_mm - 1.0).abs() < 0.25, "{of_error_mm} for {expected_mm} mm");
    }
}

#[test]
fn the_sigma_of_a_point_grows_with_the_uncertainty_of_the_axis() {
    let exact = two_lasers();
    let known = scan_moved(&exact, &solid, &laser_light, &angles(-30.0, 30.0));
    let mut vague = exact.clone();
    let n = vague.covariance.nrows();
    for i in n - 2..n {
        vague.covariance[(i, i)] = 0.05f64.powi(2);
    }
    let [exact, vague] =
        [&exact, &vague].map(|station| scan_cloud(&known.frames, station, &ScanParams::default()).unwrap().cloud);
    // (1 − R)·δ of a shift by σ along either direction across the axis has a σ of 2·sin(θ/2)·σ along any direction
    // across it.
    let added = |frame: u32| {
        let both = exact.points.iter().zip(&vague.points).filter(|(point, _)| point.frame == frame);
        let added: Vec<f64> =
            both.map(|(a, b)| f64::from(b.sigma_mm).powi(2) - f64::from(a.sigma_mm).powi(2)).collect();
        (added.iter().sum::<f64>() / added.len() as f64).max(0.0).sqrt()
    };
    assert!(added(10) < 1e-3, "at angle 0 the part is the camera's frame: {}", added(10));
    let expected_mm = 2.0 * 15f64.to_radians().sin() * 0.05;
    for frame in [0, 20] {
        assert!((added(frame) / expected_mm - 1.0).abs() < 0.1, "{} for {expected_mm}", added(frame));
    }
}

#[test]
fn frames_of_the_other_kind_of_stage_are_refused() {
    let turning = two_lasers();
    let (travelling, five) = (station(5, true), grating_station());
    let known = scan(&travelling, &|_, _| 400.0, &[-1.0, 0.0, 1.0], true);
    let refused = scan_cloud(&known.frames, &five, &ScanParams::default()).unwrap_err();
    assert!(matches!(refused, ScanError::OtherStage { calibrated: "rotary", frame: 0, found: "linear", .. }));
    let turned = scan_moved(&turning, &solid, &laser_light, &angles(0.0, 6.0));
    let linear = StageAxis::new(Vector3::x());
    let wrong =
        Calibration { stage: Some(linear.into()), covariance: DMatrix::identity(18, 18) * 1e-12, ..turning };
    let refused = scan_cloud(&turned.frames, &wrong, &ScanParams::default()).unwrap_err();
    assert!(refused.to_string().contains("rotary"), "{refused}");
    assert_eq!(refused.remedy().as_deref(), Some("use a calibration of the station that took the scan"));
}
