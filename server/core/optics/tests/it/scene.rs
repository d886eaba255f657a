//! A camera and a stage whose direction is exact apart from the effect of its straightness.

use nalgebra::{DMatrix, Vector3};
use optics::calibration::STAGE_PARAMETERS;
use optics::{
    CAMERA_PARAMETERS, Calibration, Camera, CameraFrame, DepthRangeMm, LightSurfaces, Plane, PointMm, StageAxis,
};

/// The station with this stage.
pub fn station(axis: StageAxis) -> Calibration {
    let matrix = [[2518.0, 0.0, 635.0], [0.0, 2516.0, 502.0], [0.0, 0.0, 1.0]];
    let plane = Plane::through(&Vector3::new(0.0, 0.0, 400.0), Vector3::new(0.0, -0.9, 0.4).normalize());
    let n = CAMERA_PARAMETERS + 3 + STAGE_PARAMETERS;
    let slope_variance = axis.straightness.map_or(0.0, |straightness| straightness.slope_variance());
    let variance = |i: usize, j: usize| if i == j && i >= n - STAGE_PARAMETERS { slope_variance } else { 0.0 };
    Calibration {
        id: String::new(),
        camera: Camera::from_opencv(1280, 1024, matrix, &[]),
        orders: vec![0],
        light: LightSurfaces::Planes(vec![(0, plane)]),
        stage: Some(axis.into()),
        depth_range_mm: DepthRangeMm { near_mm: 300.0, far_mm: 500.0 },
        covariance: DMatrix::from_fn(n, n, variance),
    }
}

/// Variances of the distance along x, y, z (mm²) of two points seen at `seen`, at two stage positions.
pub fn length_variances(
    calibration: &Calibration,
    seen: &PointMm<CameraFrame>,
    from_mm: f64,
    to_mm: f64,
) -> Vector3<f64> {
    let apart = |calibration: &Calibration| {
        let stage = calibration.stage.unwrap().linear().unwrap();
        stage.part_from_camera(seen, to_mm).xyz - stage.part_from_camera(seen, from_mm).xyz
    };
    let as_calibrated = apart(calibration);
    let change =
        |mode: &Vec<f64>| (apart(&calibration.stepped(mode)) - as_calibrated).map(|change| change.powi(2));
    calibration.sigma_modes().iter().map(change).sum()
}
