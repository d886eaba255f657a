//! Effect of a stage's straightness deviations on a length along its travel.

use nalgebra::Vector3;
use optics::stage::{MAX_STAGE_NODES, Straightness};
use optics::{Calibration, PointMm, StageAxis};

use crate::scene::{length_variances, station};

/// σ of the straightness, far above the covariance's.
const SIGMA_MM: f64 = 0.003;

/// A stage of this straightness.
fn calibration(straightness: Option<Straightness>) -> Calibration {
    station(StageAxis { straightness, ..StageAxis::new(Vector3::y()) })
}

/// Variances of the distance along x, y, z of two points at the same pixel and different stage positions.
fn variances(calibration: &Calibration, from_mm: f64, to_mm: f64) -> Vector3<f64> {
    let seen = PointMm::new(Vector3::new(1.0, 2.0, 400.0));
    length_variances(calibration, &seen, from_mm, to_mm)
}

#[test]
fn the_uncertainty_of_a_length_along_the_travel_matches_a_line_through_five_views() {
    let calibration = calibration(Straightness::new(SIGMA_MM, -20.0, 20.0, 5));
    // Residuals of a line through n points d apart: for the outer two of five, var = 2σ²(1 − L²/2Σs²) = 0.4 σ², where
    // Σs² = 10 d² and L = 4 d; for neighbours in the middle, L = d: 1.9 σ².
    for (from_mm, to_mm, expected) in [(-20.0, 20.0, 0.4), (0.0, 10.0, 1.9), (-10.0, 10.0, 1.6), (5.0, 5.0, 0.0)] {
        let got = variances(&calibration, from_mm, to_mm) / (SIGMA_MM * SIGMA_MM);
        assert!((got - Vector3::repeat(expected)).norm() < 1e-9, "{from_mm} to {to_mm} mm: {got}");
    }
}

#[test]
fn the_sigma_of_straightness_is_constant_between_and_beyond_the_nodes() {
    let calibration = calibration(Straightness::new(SIGMA_MM, -20.0, 20.0, 5));
    let n = calibration.covariance.nrows();
    for position_mm in [-20.0, -17.3, -15.0, 3.3, 19.9, 20.0, 31.0] {
        let of_node = |node: usize| {
            let mut step = vec![0.0; n + 15];
            step[n + 3 * node] = SIGMA_MM;
            let straightness = calibration.stepped(&step).stage.unwrap().linear().unwrap().straightness.unwrap();
            straightness.deviation_mm(position_mm).x.powi(2)
        };
        let sum: f64 = (0..5).map(of_node).sum();
        assert!((sum.sqrt() / SIGMA_MM - 1.0).abs() < 1e-12, "{position_mm} mm");
    }
}

#[test]
fn a_stage_of_unknown_straightness_has_no_modes_for_it() {
    let unknown = calibration(None);
    assert_eq!(unknown.stage.unwrap().linear().unwrap().straightness, None);
    assert!(unknown.sigma_modes().is_empty());
}

#[test]
fn more_views_than_nodes_are_limited_and_invalid_arguments_are_refused() {
    assert_eq!(Straightness::new(SIGMA_MM, 0.0, 1.0, 40).unwrap().n_nodes(), MAX_STAGE_NODES);
    for (sigma_mm, last_mm, n_nodes) in [(0.0, 1.0, 3), (f64::NAN, 1.0, 3), (0.1, 0.0, 3), (0.1, 1.0, 1)] {
        assert_eq!(Straightness::new(sigma_mm, 0.0, last_mm, n_nodes), None);
    }
}
