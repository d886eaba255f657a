//! The axis of a turntable from boards on it: errors match their covariance, and data that do not determine it are
//! refused by name.
//!
//! The angle error here is independent at every view, as in the model; the wobble of real tables is not covered.

use std::f64::consts::FRAC_PI_2;

use crate::common::{COLUMNS, ROWS, Rig, SQUARE_MM, calibrated};
use calibration::{CalibrationDocument, CalibrationError, CalibrationInput, StageViewInput};
use nalgebra::{Matrix4, Rotation3, Vector3, Vector4};
use optics::rotation::completing_frame;
use optics::{BoardFrame, Calibration, CameraFrame, PartFrame, PointMm, Rigid, RotaryAxis, StagePosition};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use remedy::{Remedy, with_remedy};

/// Number of stations in the statistics.
const STATIONS: u64 = 100;
/// Accepted RMS of an error over its σ: contains 99.8 % of the RMS of 100 normal numbers.
const NORMALISED_RMS: std::ops::Range<f64> = 0.78..1.22;
/// σ of the table's angles: it moves the board by 7 µm of arc, of which 0.3 µm is detectable.
const ANGLE_SIGMA_DEG: f64 = 0.02;
/// Angles of the views.
const ANGLES_DEG: [f64; 9] = [-60.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0];

fn truth() -> RotaryAxis {
    RotaryAxis::new(Vector3::new(3.0, -12.0, 410.0), Vector3::new(0.03, -0.96, 0.28))
}

/// Boards in six poses, without laser light, and one on a table at the angles, with errors of `sigma_deg`.
fn turning(seed: u64, angles_deg: &[f64], sigma_deg: f64) -> CalibrationInput {
    let rig = Rig { orders: vec![0], corner_sigma_px: 0.02, ..Rig::new(seed) };
    let mut input = rig.input(8, 0);
    input.poses.iter_mut().for_each(|pose| pose.centrelines = None);
    let mut random = Pcg64Mcg::seed_from_u64(seed + 7_000_000);
    let middle = Vector3::new((COLUMNS - 1) as f64, (ROWS - 1) as f64, 0.0) * (SQUARE_MM / 2.0);
    let upright = Rotation3::from_euler_angles(0.2, 0.1, 0.05);
    let centre = Vector3::new(1.0, -4.0, 392.0);
    let on_table: Rigid<PartFrame, BoardFrame> = Rigid::new(upright, centre - upright * middle);
    input.stage_views = angles_deg
        .iter()
        .enumerate()
        .map(|(idx, &angle_deg)| {
            let error: f64 = StandardNormal.sample(&mut random);
            let pose = turned(&truth(), &on_table, angle_deg + sigma_deg * error);
            StageViewInput {
                name: format!("stage/{idx:03}.png"),
                corners: rig.corners(&pose, &mut random),
                position: StagePosition::RotaryDeg(angle_deg),
            }
        })
        .collect();
    input
}

fn turned(
    axis: &RotaryAxis,
    board: &Rigid<PartFrame, BoardFrame>,
    angle_deg: f64,
) -> Rigid<CameraFrame, BoardFrame> {
    let motion = axis.motion(angle_deg.to_radians());
    let place = |on_board: Vector3<f64>| motion.camera_from_part(&(*board * PointMm::new(on_board))).xyz;
    let origin = place(Vector3::zeros());
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| place(axis) - origin);
    Rigid::new(Rotation3::from_basis_unchecked(&axes), origin)
}

/// Error of the axis in its four parameters, and its covariance.
fn error(calibration: &Calibration) -> (Vector4<f64>, Matrix4<f64>) {
    let axis = calibration.stage.unwrap().rotary().unwrap();
    let (first, second) = completing_frame(&axis.direction);
    let off = truth().with_point_near(&axis.point_mm).point_mm - axis.point_mm;
    let tilt = truth().direction;
    let n = calibration.covariance.nrows();
    let covariance = calibration.covariance.fixed_view::<4, 4>(n - 4, n - 4).into_owned();
    (Vector4::new(first.dot(&tilt), second.dot(&tilt), first.dot(&off), second.dot(&off)), covariance)
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn errors_of_the_axis_match_its_covariance() {
    for stated in [None, Some(ANGLE_SIGMA_DEG)] {
        let (mut whitened, mut single): (Vec<f64>, [Vec<f64>; 4]) = Default::default();
        let mut sigmas = Vec::new();
        for seed in 0..STATIONS {
            let mut input = turning(seed, &ANGLES_DEG, ANGLE_SIGMA_DEG);
            input.angle_sigma_deg = stated;
            let calibration = calibrated(&input).unwrap().calibration;
            let (error, covariance) = error(&calibration);
            let lower = covariance.cholesky().unwrap().l();
            whitened.extend(lower.solve_lower_triangular(&error).unwrap().iter());
            (0..4).for_each(|i| single[i].push(error[i] / covariance[(i, i)].sqrt()));
            sigmas
                .push(calibration.stage.unwrap().rotary().unwrap().angle_error.unwrap().sigma_rad().to_degrees());
        }
        let figures = [0, 1, 2, 3].map(|i| rms(&single[i]));
        let angle_sigma_deg = sigmas.iter().sum::<f64>() / sigmas.len() as f64;
        eprintln!("normalised: all {:.3}, each {figures:.3?}; σ of angle {angle_sigma_deg:.4}°", rms(&whitened));
        assert!(NORMALISED_RMS.contains(&rms(&whitened)), "{stated:?}: {}", rms(&whitened));
        assert!(figures.iter().all(|figure| NORMALISED_RMS.contains(figure)), "{stated:?}: {figures:?}");
        // From nine views, too large rather than too small by design (Student's t).
        assert!((0.9..1.4).contains(&(angle_sigma_deg / ANGLE_SIGMA_DEG)), "{angle_sigma_deg}");
    }
}

#[test]
fn an_axis_is_read_back_from_its_document_and_a_damaged_one_is_named() {
    let result = calibrated(&turning(1, &ANGLES_DEG, ANGLE_SIGMA_DEG)).unwrap();
    let text = CalibrationDocument::new(&result, Vec::new(), "1").to_json();
    let again = CalibrationDocument::parse(&text).unwrap().calibration();
    let [was, is] = [&result.calibration, &again].map(|calibration| calibration.stage.unwrap().rotary().unwrap());
    assert_eq!((was.point_mm, was.direction), (is.point_mm, is.direction));
    let [was, is] = [was, is].map(|axis| axis.angle_error.unwrap().sigma_rad());
    assert!((was / is - 1.0).abs() < 1e-12);
    assert!(text.contains("\"kind\": \"rotary\"") && text.contains("axis_tilt_1"));
    for (entry, value) in [("direction", serde_json::json!([0.0, 2.0, 0.0])), ("angle_sigma_deg", 0.0.into())] {
        let mut broken: serde_json::Value = serde_json::from_str(&text).unwrap();
        broken["stage"][entry] = value;
        let refused = CalibrationDocument::parse(&broken.to_string()).unwrap_err().to_string();
        assert!(refused.contains(&format!("stage.{entry}")), "{refused}");
    }
}

#[test]
fn views_that_do_not_determine_the_axis_are_refused_with_the_remedy() {
    let refused = |angles_deg: &[f64]| calibrated(&turning(2, angles_deg, 0.0)).unwrap_err();
    let few = CalibrationError::TooFewStageAngles { needed: 3, got: 2 };
    assert_eq!(refused(&[0.0, 30.0]), few);
    // The same angle again, and one full turn later.
    assert_eq!(refused(&[0.0, 30.0, 0.0, 30.1]), few);
    assert_eq!(refused(&[0.0, 30.0, 360.0, 390.0]), few);
    assert!(few.remedy().unwrap().contains("add stage views at other angles"), "{few}");
    let narrow = refused(&[-0.5, 0.0, 0.5]);
    assert!(matches!(narrow, CalibrationError::AxisUnobservable { .. }), "{narrow}");
    assert!(narrow.remedy().unwrap().contains("30–90° apart"), "{narrow}");
}

#[test]
fn a_board_that_does_not_rotate_as_stated_is_named() {
    let mut mistyped = turning(3, &ANGLES_DEG, 0.0);
    mistyped.stage_views[6].position = StagePosition::RotaryDeg(80.0);
    let refused = calibrated(&mistyped).unwrap_err();
    let CalibrationError::RotationMismatch { view, stated_deg, observed_deg, .. } = &refused else {
        panic!("{refused}")
    };
    assert_eq!(view, "stage/006.png");
    assert!((stated_deg.abs() - observed_deg.abs()).abs() > 40.0, "{refused}");
    // All poses parallel: the board stood still while the table stated a rotation.
    let mut still = turning(3, &[0.0; 4], 0.0);
    for (idx, view) in still.stage_views.iter_mut().enumerate() {
        view.position = StagePosition::RotaryDeg(20.0 * idx as f64);
    }
    let refused = with_remedy(&calibrated(&still).unwrap_err());
    assert!(refused.contains("rotated by 0.0") && refused.contains("fixed to the table"), "{refused}");
    let mut mixed = turning(3, &ANGLES_DEG, 0.0);
    mixed.stage_views[4].position = StagePosition::LinearMm(1.0);
    let refused = calibrated(&mixed).unwrap_err();
    assert!(
        matches!(&refused, CalibrationError::MixedStages { view, .. } if view == "stage/004.png"),
        "{refused}"
    );
}

#[test]
fn a_table_of_unknown_accuracy_is_reported_and_wobble_gives_a_warning() {
    let few = calibrated(&turning(4, &[-50.0, 0.0, 50.0], 0.0)).unwrap();
    assert_eq!(few.calibration.stage.unwrap().rotary().unwrap().angle_error, None);
    assert!(few.report.warnings.iter().any(|warning| warning.contains("stage.angle_sigma_deg")));
    let mut wobbling = turning(4, &ANGLES_DEG, 0.0);
    for (idx, view) in wobbling.stage_views.iter_mut().enumerate() {
        // Up and down by 2 px, 0.3 mm.
        view.corners.corners.iter_mut().for_each(|corner| corner.v_px += 2.0 * (FRAC_PI_2 * idx as f64).sin());
    }
    let wobbling = calibrated(&wobbling).unwrap();
    let steady = calibrated(&turning(4, &ANGLES_DEG, 0.0)).unwrap();
    assert!(wobbling.report.warnings.iter().any(|warning| warning.contains("does not rotate about a fixed axis")));
    assert!(steady.report.warnings.iter().all(|warning| !warning.contains("does not rotate")));
    let [wide, narrow] = [wobbling, steady].map(|result| result.report.axis.unwrap().tilt_sigma_deg[0]);
    assert!(wide > 3.0 * narrow, "{wide} {narrow}");
}
