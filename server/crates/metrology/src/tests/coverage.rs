//! The stated uncertainty with a calibration: does it hold the truth as often as it says?

use super::station::{gauge_scan, station};
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
    // The calibration dominates here: without it the uncertainty would be an illusion.
    assert!(results.iter().all(|r| r.u_systematic.unwrap() > 2.0 * r.u_noise));
}

#[test]
fn the_calibration_does_not_move_the_value() {
    let (cloud, calibration) = gauge_scan(HEIGHT_MM, 3);
    let request = MeasureRequest::new(Tool::Step);
    let with = measure(&cloud, Some(&calibration), &request).unwrap();
    let without = measure(&cloud, None, &request).unwrap();
    assert_eq!(with.value, without.value);
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
