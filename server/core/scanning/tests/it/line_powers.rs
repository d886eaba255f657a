//! The powers of independent lasers on rendered scans in which one of them fades. Not covered: lasers that light a part
//! from different sides.

use nalgebra::DMatrix;
use optics::{Calibration, DepthRangeMm, LightSurfaces, Plane, StagePosition};
use rayon::prelude::*;
use scanning::{
    OrderPowers, PowerReference, ScanFrame, ScanParams, Watch, WatchReport, WatchState, WatchVerdict,
    evaluate_scan, verdicts, watch_scan,
};
use twin::{ProjectorShape, Renderer, SceneKind, StationModel, StationShape};
use vision::{CentrelineParams, find_centrelines};

/// Frames of a scan, 1 mm apart: twice as far as the two lines are from each other, so that both observe half of it.
const N_FRAMES: usize = 80;

/// Two lasers without a grating.
fn station() -> StationModel {
    let shape = StationShape {
        width_px: 640,
        height_px: 512,
        line_sigma_px: 1.5,
        projector: ProjectorShape::Lasers { lines: 2 },
        ..StationShape::default()
    };
    StationModel::seeded(7, &shape).unwrap()
}

fn calibration(model: &StationModel) -> Calibration {
    let planes =
        model.lasers.iter().zip(0i8..).map(|(laser, line)| {
            (line, Plane::through(&laser.source_mm, laser.axis.cross(&laser.fan).normalize()))
        });
    let mut orders = model.orders.clone();
    orders.sort_unstable();
    let exact = Calibration {
        id: "twin".into(),
        camera: model.camera,
        orders,
        light: LightSurfaces::Planes(planes.collect()),
        stage: Some(model.stage),
        depth_range_mm: DepthRangeMm { near_mm: 350.0, far_mm: 450.0 },
        covariance: DMatrix::zeros(0, 0),
    };
    let n = exact.parameter_names().len();
    Calibration { covariance: DMatrix::zeros(n, n), ..exact }
}

fn watched(calibration: &Calibration, model: &StationModel, part: &SceneKind, noise: u64) -> WatchReport {
    let (renderer, scene) = (Renderer::new(model), part.placed(model, 0x100 + noise));
    let frame = |idx: usize| {
        let position_mm = idx as f64 - 0.5 * N_FRAMES as f64;
        let image = renderer.laser_image(&scene, position_mm, noise * 1000 + idx as u64);
        let centrelines = find_centrelines(&image, &CentrelineParams::default());
        ScanFrame { centrelines, position: StagePosition::LinearMm(position_mm) }
    };
    let frames: Vec<ScanFrame> = (0..N_FRAMES).into_par_iter().map(frame).collect();
    let frames = &frames[..];
    let evaluation = evaluate_scan(&frames, calibration, &ScanParams::default()).unwrap();
    watch_scan(&evaluation, calibration).unwrap().unwrap()
}

#[test]
fn the_laser_that_fades_is_named() {
    let model = station();
    let calibration = calibration(&model);
    let parts = [SceneKind::Freeform, SceneKind::Plate];
    let first: Vec<OrderPowers> =
        (0..2).map(|idx| watched(&calibration, &model, &parts[idx], idx as u64).powers.unwrap()).collect();
    // As many scans as a reference needs, of two parts.
    let reference = PowerReference::of(&[0, 1, 0, 1, 0].map(|idx: usize| first[idx].clone())).unwrap();
    eprintln!("{reference:?}");
    let by = |factors: [f64; 2]| -> WatchVerdict {
        let mut changed = model.clone();
        for (power, line) in changed.order_powers.iter_mut().zip(&model.orders) {
            *power *= factors[usize::try_from(*line).unwrap()];
        }
        let report = watched(&calibration, &changed, &SceneKind::Freeform, 5);
        let all = verdicts(&report, 0.02, Some(&reference));
        all.into_iter().find(|verdict| verdict.watch == Watch::OrderPowers).unwrap()
    };
    let clean = by([1.0, 1.0]);
    assert_eq!((clean.state, clean.line), (WatchState::Quiet, None), "{clean:?}");
    for line in [0, 1] {
        let mut factors = [1.0, 1.0];
        factors[line] = 0.7;
        let faded = by(factors);
        eprintln!("{faded:?}");
        assert_eq!((faded.state, faded.line), (WatchState::Warning, i8::try_from(line).ok()), "{faded:?}");
        assert!(faded.reason.contains(&format!("line {line} has lost light")), "{faded:?}");
        // 70 % of the light.
        assert!((faded.estimate.unwrap().value - 0.7f64.ln()).abs() < 0.05, "{faded:?}");
    }
}
