//! A part and calibrations for the tests of the watches.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use optics::{Calibration, DepthRangeMm, LightSurfaces};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use twin::{Scene, Solid, StationModel};

/// One σ of the random calibrations: focal lengths and centre (px), distortion, source (mm), directions (rad), gap (mm)
/// and λ/d of the grating, and the stage's travel.
const CAMERA_SIGMAS: [f64; 9] = [0.1, 0.1, 0.1, 0.1, 2e-4, 1e-3, 5e-6, 5e-6, 0.0];
const GRATING_SIGMAS: [f64; 10] = [0.01, 0.01, 0.02, 2e-5, 2e-5, 2e-5, 1e-4, 1e-4, 0.01, 1e-7];
const STAGE_SIGMAS: [f64; 3] = [2e-5, 5e-5, 2e-5];

/// A random calibration of the station, drawn from its covariance.
pub fn random_calibration(model: &StationModel, seed: u64) -> Calibration {
    let mut orders = model.orders.clone();
    orders.sort_unstable();
    let sigmas: Vec<f64> = CAMERA_SIGMAS.into_iter().chain(GRATING_SIGMAS).chain(STAGE_SIGMAS).collect();
    let truth = Calibration {
        id: "twin".into(),
        camera: model.camera,
        orders,
        light: LightSurfaces::Grating(model.grating),
        stage: Some(model.stage),
        depth_range_mm: DepthRangeMm { near_mm: 350.0, far_mm: 450.0 },
        covariance: DMatrix::from_diagonal(&DVector::from_iterator(22, sigmas.iter().map(|s| s * s))),
    };
    let mut rng = Pcg64::seed_from_u64(seed);
    // Sums of twelve uniform numbers are sufficiently normal.
    let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
    truth.stepped(&sigmas.iter().map(|sigma| sigma * normal()).collect::<Vec<_>>())
}

/// A part like an egg carton: bumps of ±3 mm, slopes up to 0.375.
pub fn egg_carton(model: &StationModel) -> Scene {
    let height = |x: f64, y: f64| 3.5 + 3.0 * (x / 8.0).sin() * (y / 8.0).sin();
    let corner = |column: i32, row: i32| {
        let (x, y) = (f64::from(column) * 1.5, f64::from(row) * 1.5);
        [x, y, height(x, y)]
    };
    let mut triangles = Vec::new();
    for (column, row) in (-40..40).flat_map(|column| (-30..30).map(move |row| (column, row))) {
        let [a, b] = [corner(column, row), corner(column + 1, row)];
        let [c, d] = [corner(column + 1, row + 1), corner(column, row + 1)];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    Scene::mesh(Arc::new(Solid::new(&triangles).unwrap()), model, 0x100)
}
