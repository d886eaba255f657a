//! The stage's direction, scale, straightness and tilt: errors match their σ, and too few views are refused.
//!
//! The stage here deviates independently at every view and equally along all axes, as in the model; deviations of real
//! stages are not covered.

use crate::common::{Rig, calibrated};
use calibration::document::StageText;
use calibration::{CalibrationDocument, CalibrationError, CalibrationInput, CalibrationOptions, LightModelChoice};
use nalgebra::Vector3;
use optics::rotation::completing_frame;
use optics::{Calibration, LightModelKind, PointMm, StageAxis, StagePosition};
use remedy::Remedy;

/// Number of stations in the statistics.
const STATIONS: u64 = 100;
/// Accepted RMS of an error over its σ: contains 99.8 % of the RMS of 100 to 200 normal numbers.
const NORMALISED_RMS: std::ops::Range<f64> = 0.85..1.16;
/// σ of the stage, mm: well above the 0.5 µm uncertainty of a board's position across the view.
const WOBBLE_MM: f64 = 0.005;
/// σ of the carriage's rotation, rad: well above the 0.05 mrad uncertainty of a board's rotation.
const YAW_RAD: f64 = 5e-4;
/// Views and their spacing, as [`Rig::input`] places them.
const VIEWS: usize = 5;

fn without_laser(mut input: CalibrationInput) -> CalibrationInput {
    input.poses.iter_mut().for_each(|pose| pose.centrelines = None);
    input
}

/// A rig whose stage wobbles; with a single line, for speed.
fn wobbling(seed: u64, wobble_sigma_mm: f64) -> Rig {
    Rig { orders: vec![0], corner_sigma_px: 0.02, wobble_sigma_mm, ..Rig::new(seed) }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// σ of a part's length along the travel, `arm` away from the path of the board's centre, from the calibration's modes.
fn length_sigma_mm(calibration: &Calibration, arm: &Vector3<f64>, from_mm: f64, to_mm: f64) -> f64 {
    let tilt = calibration.stage.unwrap().linear().unwrap().tilt;
    let seen = PointMm::new(tilt.map_or(Vector3::new(0.0, 0.0, 400.0), |tilt| *tilt.centre_mm()) + arm);
    let length = |calibration: &Calibration| {
        let stage = calibration.stage.unwrap().linear().unwrap();
        let apart = stage.part_from_camera(&seen, from_mm).xyz - stage.part_from_camera(&seen, to_mm).xyz;
        apart.dot(&Vector3::new(-0.005, 0.9998, -0.02).normalize())
    };
    let base = length(calibration);
    rms(&calibration
        .sigma_modes()
        .iter()
        .map(|mode| length(&calibration.stepped(mode)) - base)
        .collect::<Vec<_>>())
        * (calibration.sigma_modes().len() as f64).sqrt()
}

#[test]
fn errors_of_direction_and_scale_match_their_sigma() {
    let (mut scales, mut directions, mut whole, mut half) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for seed in 0..STATIONS {
        let rig = wobbling(seed, WOBBLE_MM);
        let (input, wobble) = rig.wobbling_input(6, VIEWS);
        let calibration = calibrated(&without_laser(input)).unwrap().calibration;
        let error = calibration.stage.unwrap().linear().unwrap().direction - rig.stage;
        let n = calibration.covariance.nrows();
        let covariance = calibration.covariance.fixed_view::<3, 3>(n - 3, n - 3).into_owned();
        let sigma = |axis: &Vector3<f64>| (axis.transpose() * covariance * axis)[(0, 0)].sqrt();
        let along = rig.stage.normalize();
        let (across_1, across_2) = completing_frame(&along);
        scales.push(error.dot(&along) / sigma(&along));
        directions.extend([across_1, across_2].map(|across| error.dot(&across) / sigma(&across)));
        // A part as long as the travel between two views: the stage deviates there as it did during calibration.
        for (views, lengths) in [((0, VIEWS - 1), &mut whole), ((1, 3), &mut half)] {
            let [from_mm, to_mm] = [views.0, views.1].map(|view| -20.0 + 10.0 * view as f64);
            let apart = wobble[views.1].0 - wobble[views.0].0 - error * (to_mm - from_mm);
            lengths.push(apart.dot(&along) / length_sigma_mm(&calibration, &Vector3::zeros(), from_mm, to_mm));
        }
    }
    let figures = [&scales, &directions, &whole, &half].map(|errors| rms(errors));
    eprintln!("scale, direction, length over all, over half of the travel: {figures:.3?}");
    assert!(NORMALISED_RMS.contains(&figures[0]), "scale {}", figures[0]);
    assert!(NORMALISED_RMS.contains(&figures[1]), "direction {}", figures[1]);
    // Deviations from the fitted line itself: (3n − 8)/(3n − 6) of the variance of a new length.
    let expected = (7.0f64 / 9.0).sqrt();
    for length in &figures[2..] {
        assert!((0.85 * expected..1.16).contains(length), "length {length}");
    }
}

/// Errors over σ of lengths 30 mm above the board on stages that pitch, yaw and roll.
fn lengths_above_the_board(is_tilt_known: bool) -> Vec<f64> {
    let arm = Vector3::new(0.0, 0.0, -30.0);
    let mut lengths = Vec::new();
    for seed in 0..STATIONS {
        let rig = Rig { yaw_sigma_rad: YAW_RAD, ..wobbling(seed, WOBBLE_MM) };
        let (input, wobble) = rig.wobbling_input(6, VIEWS);
        let mut calibration = calibrated(&without_laser(input)).unwrap().calibration;
        let mut axis = calibration.stage.unwrap().linear().unwrap();
        axis.tilt = axis.tilt.filter(|_| is_tilt_known);
        calibration.stage = Some(axis.into());
        let error = axis.direction - rig.stage;
        for views in [(0, VIEWS - 1), (1, 3)] {
            let [from_mm, to_mm] = [views.0, views.1].map(|view| -20.0 + 10.0 * view as f64);
            let place = |view: usize| wobble[view].0 + wobble[view].1 * arm;
            let apart = place(views.1) - place(views.0) - error * (to_mm - from_mm);
            let sigma_mm = length_sigma_mm(&calibration, &arm, from_mm, to_mm);
            lengths.push(apart.dot(&rig.stage.normalize()) / sigma_mm);
        }
    }
    lengths
}

#[test]
fn errors_of_lengths_away_from_the_board_match_their_sigma() {
    let above = rms(&lengths_above_the_board(true));
    let without = rms(&lengths_above_the_board(false));
    eprintln!("30 mm above the board {above:.3}, without the tilt {without:.3}");
    // These rotations are themselves the ones that determined σ, with n − 3 = 2 instead of n − 1 = 4 degrees of freedom.
    let expected = 0.5f64.sqrt();
    assert!((0.85 * expected..1.16 * expected).contains(&above), "{above}");
    assert!(without > 2.0, "{without}");
}

#[test]
fn a_stage_straight_within_the_noise_is_not_assumed_perfect() {
    for seed in 0..5 {
        let input = without_laser(wobbling(seed, 0.0).input(6, VIEWS));
        let stage = calibrated(&input).unwrap().calibration.stage.unwrap().linear().unwrap();
        let sigma_mm = stage.straightness.unwrap().sigma_mm();
        // Less than the noise of a board's position along the view (about 3 µm), more than a tenth of that across it
        // (0.3 µm).
        assert!((0.00003..0.003).contains(&sigma_mm), "{sigma_mm} mm");
    }
}

#[test]
fn straightness_and_tilt_are_stored_and_unknown_in_older_documents() {
    let result = calibrated(&without_laser(wobbling(1, WOBBLE_MM).input(6, VIEWS))).unwrap();
    let document = CalibrationDocument::new(&result, Vec::new(), "1");
    let text = document.to_json();
    let again = CalibrationDocument::parse(&text).unwrap().calibration();
    assert_eq!(again.stage, result.calibration.stage);
    assert!(again.stage.unwrap().linear().unwrap().straightness.unwrap().ends_mm() == (-20.0, 20.0));
    let mut older: serde_json::Value = serde_json::from_str(&text).unwrap();
    older["stage"].as_object_mut().unwrap().remove("straightness");
    older["stage"].as_object_mut().unwrap().remove("tilt");
    let older = CalibrationDocument::parse(&older.to_string()).unwrap().calibration();
    assert_eq!(older.stage, Some(StageAxis::new(again.stage.unwrap().linear().unwrap().direction).into()));
    let mut broken = document;
    let Some(StageText::Linear(travel)) = &mut broken.calibration.stage else { panic!("it travels") };
    travel.straightness.as_mut().unwrap().sigma_mm = 0.0;
    let refused = CalibrationDocument::parse(&broken.to_json()).unwrap_err().to_string();
    assert!(refused.contains("stage.straightness"), "{refused}");
    let Some(StageText::Linear(travel)) = &mut broken.calibration.stage else { panic!("it travels") };
    travel.straightness = None;
    travel.tilt.as_mut().unwrap().sigmas_rad = [[0.0; 3]; 3];
    let refused = CalibrationDocument::parse(&broken.to_json()).unwrap_err().to_string();
    assert!(refused.contains("stage.tilt"), "{refused}");
}

#[test]
fn stage_views_at_two_positions_are_refused_with_the_remedy() {
    for n_views in [1, 2] {
        let refused = calibrated(&wobbling(1, 0.0).input(6, n_views)).unwrap_err();
        assert_eq!(refused, CalibrationError::TooFewStageViews { needed: 3, got: n_views });
        assert!(refused.remedy().unwrap().starts_with("add stage views"), "{refused}");
    }
    let mut twice = wobbling(1, 0.0).input(6, 4);
    twice.stage_views[1].position = StagePosition::LinearMm(-20.0);
    twice.stage_views[3].position = StagePosition::LinearMm(0.01);
    let refused = calibrated(&twice).unwrap_err();
    assert_eq!(refused, CalibrationError::TooFewStageViews { needed: 3, got: 2 });
}

#[test]
fn every_model_and_refinement_includes_straightness() {
    // 1 µm is hidden in the corners' noise and the travel is refined as straight; 20 µm is not.
    for (wobble_sigma_mm, kind) in
        [0.001, 0.02].into_iter().flat_map(|wobble| LightModelKind::ALL.map(|kind| (wobble, kind)))
    {
        let rig = Rig { corner_sigma_px: 0.02, wobble_sigma_mm, ..Rig::new(21) };
        let options = CalibrationOptions { light_model: LightModelChoice::Fixed(kind), ..Default::default() };
        let result = calibration::calibrate(&rig.input(6, VIEWS), &options, &mut |_, _| {
            calibration::ProgressControl::Continue
        })
        .unwrap();
        let is_bent = result.report.warnings.iter().any(|warning| warning.contains("does not travel straight"));
        assert_eq!(is_bent, wobble_sigma_mm > 0.01, "{kind}, {wobble_sigma_mm} mm: {:?}", result.report.warnings);
        let calibration = result.calibration;
        let straightness = calibration.stage.unwrap().linear().unwrap().straightness.unwrap();
        let n = calibration.covariance.nrows();
        for i in n - 3..n {
            assert!(calibration.covariance[(i, i)] > straightness.slope_variance(), "{kind}");
        }
        let error = calibration.stage.unwrap().linear().unwrap().direction - rig.stage;
        let sigma = result.report.stage.unwrap().sigma;
        // Three components of one station, at four of their σ.
        assert!((0..3).all(|axis| error[axis].abs() < 4.0 * sigma[axis]), "{kind}: {error} {sigma:?}");
    }
}
