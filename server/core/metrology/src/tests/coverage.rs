//! Coverage of the stated uncertainty with a calibration: how often it contains the truth.

use super::station::{Plan, gauge_scan, planned_scan, station};
use crate::*;

const HEIGHT_MM: f64 = 8.9;

#[test]
fn the_truth_lies_within_u_in_about_ninety_five_of_a_hundred_calibrations() {
    const SEEDS: u64 = 30;
    let results: Vec<Measurement> = (0..SEEDS)
        .map(|seed| {
            let (cloud, calibration) = gauge_scan(HEIGHT_MM, seed);
            measure(&cloud, Some(&calibration), &MeasureRequest::new(Tool::Step)).unwrap()
        })
        .collect();
    let normalised: Vec<f64> =
        results.iter().map(|r| (r.value - HEIGHT_MM) / (r.expanded_uncertainty / 2.0)).collect();
    let inside = normalised.iter().filter(|error| error.abs() <= 2.0).count();
    let rms = (normalised.iter().map(|e| e * e).sum::<f64>() / SEEDS as f64).sqrt();
    eprintln!("{inside} of {SEEDS} inside U, normalised RMS {rms:.2}");
    // Fewer than 25 of 30 has a probability of 0.4 %; an RMS of 30 standard normal values lies in 0.62–1.4 (99.8 %).
    assert!(inside >= 25, "{inside} of {SEEDS}: {normalised:?}");
    assert!((0.62..1.4).contains(&rms), "{rms}");
    // The calibration dominates here: without it the uncertainty would be far too small.
    assert!(results.iter().all(|r| r.u_systematic.unwrap() > 2.0 * r.u_noise));
}

/// Errors over u_noise of steps whose only error is speckle; frames 0.1 mm apart, sheets of 0.35 mm that the cloud
/// states as `stated_mm`.
fn speckle_errors(seeds: u64, stated_mm: f64) -> Vec<f64> {
    let plan = Plan { n_frames: 160, step_mm: 0.1, pitch_mm: 1.5, sheet_sigma_mm: 0.35, sampled: false };
    (0..seeds)
        .map(|seed| {
            let (mut cloud, _) = planned_scan(HEIGHT_MM, seed, &plan);
            for line in cloud.comments.iter_mut().filter(|line| line.starts_with("line_sigma_mm ")) {
                *line = format!("line_sigma_mm {stated_mm}");
            }
            let result = measure(&cloud, None, &MeasureRequest::new(Tool::Step)).unwrap();
            (result.value - HEIGHT_MM) / result.u_noise
        })
        .collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn u_includes_speckle_that_moves_with_the_surface() {
    let normalised = speckle_errors(200, 0.35);
    let inside = normalised.iter().filter(|error| error.abs() <= 2.0).count();
    eprintln!("{inside} of 200 inside U, normalised RMS {:.2}", rms(&normalised));
    // 200 normal values: 181–198 within two σ, RMS 0.85–1.16 (99.8 %).
    assert!((181..=198).contains(&inside), "{inside}");
    assert!((0.85..1.16).contains(&rms(&normalised)), "{}", rms(&normalised));
}

#[test]
fn an_uncertainty_without_speckle_along_the_travel_is_too_small() {
    // Sheets stated to be thin share no speckle: the errors are then √12 times what is stated.
    let normalised = speckle_errors(20, 0.01);
    assert!(rms(&normalised) > 2.0, "{}", rms(&normalised));
}

#[test]
fn flat_features_keep_their_value_without_a_calibration_and_lose_their_verdict() {
    // Curved ones do not keep their value: the light's position selects their points (`shading`).
    let (cloud, calibration) = gauge_scan(HEIGHT_MM, 3);
    let request =
        MeasureRequest { nominal_mm: Some(HEIGHT_MM), tolerance_mm: Some(1.0), ..MeasureRequest::new(Tool::Step) };
    let with = measure(&cloud, Some(&calibration), &request).unwrap();
    let without = measure(&cloud, None, &request).unwrap();
    assert_eq!(with.value, without.value);
    assert_eq!((with.verdict, with.missing), (Some(Verdict::Pass), vec![]));
    assert_eq!((without.verdict, without.missing), (Some(Verdict::Undecided), vec![Missing::Calibration]));
    assert_eq!(without.u_systematic, None);
    assert!(without.notes.iter().any(|note| note.contains("no calibration")));
}

#[test]
fn a_calibration_of_another_scan_is_refused() {
    let (cloud, _) = gauge_scan(HEIGHT_MM, 3);
    let mut other = station();
    other.camera.fx_px += 20.0;
    let result = measure(&cloud, Some(&other), &MeasureRequest::new(Tool::Step));
    assert!(matches!(result, Err(MeasureError::CalibrationMismatch { .. })), "{result:?}");
}
