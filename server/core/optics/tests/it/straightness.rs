//! Effect of a stage's straightness deviations on a length along its travel.

use nalgebra::{DMatrix, Vector3};
use optics::calibration::STAGE_PARAMETERS;
use optics::stage::{MAX_STAGE_NODES, Straightness};
use optics::{CAMERA_PARAMETERS, Calibration, Camera, DepthRangeMm, LightSurfaces, Plane, PointMm, StageAxis};

/// σ of the straightness, far above the covariance's.
const SIGMA_MM: f64 = 0.003;

/// A camera and a stage whose direction is exact apart from the effect of straightness.
fn calibration(straightness: Option<Straightness>) -> Calibration {
    let matrix = [[2518.0, 0.0, 635.0], [0.0, 2516.0, 502.0], [0.0, 0.0, 1.0]];
    let plane = Plane::through(&Vector3::new(0.0, 0.0, 400.0), Vector3::new(0.0, -0.9, 0.4).normalize());
    let n = CAMERA_PARAMETERS + 3 + STAGE_PARAMETERS;
    let slope_variance = straightness.map_or(0.0, |straightness| straightness.slope_variance());
    let variance = |i: usize, j: usize| if i == j && i >= n - STAGE_PARAMETERS { slope_variance } else { 0.0 };
    Calibration {
        id: String::new(),
        camera: Camera::from_opencv(1280, 1024, matrix, &[]),
        orders: vec![0],
        light: LightSurfaces::Planes(vec![(0, plane)]),
        stage: Some(StageAxis { direction: Vector3::y(), straightness, tilt: None }.into()),
        depth_range_mm: DepthRangeMm { near_mm: 300.0, far_mm: 500.0 },
        covariance: DMatrix::from_fn(n, n, variance),
    }
}

/// Variances of the distance along x, y, z of two points at the same pixel and different stage positions.
fn variances(calibration: &Calibration, from_mm: f64, to_mm: f64) -> Vector3<f64> {
    let seen = PointMm::new(Vector3::new(1.0, 2.0, 400.0));
    let apart = |calibration: &Calibration| {
        let stage = calibration.stage.unwrap().linear().unwrap();
        stage.part_from_camera(&seen, to_mm).xyz - stage.part_from_camera(&seen, from_mm).xyz
    };
    let as_calibrated = apart(calibration);
    let change =
        |mode: &Vec<f64>| (apart(&calibration.stepped(mode)) - as_calibrated).map(|change| change.powi(2));
    calibration.sigma_modes().iter().map(change).sum()
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
