//! Watches on rendered scans of stations with and without drift. Not covered: a calibration with an error outside its
//! covariance.

use optics::{Calibration, StagePosition};
use rayon::prelude::*;
use scanning::{
    OrderPowers, PowerReference, ScanFrame, ScanParams, Watch, WatchReport, WatchState, WatchVerdict,
    evaluate_scan, verdicts, watch_scan,
};
use twin::{Renderer, Scene, SceneKind, StationModel, StationShape};
use vision::{CentrelineParams, find_centrelines};

use crate::common::watched::{egg_carton, random_calibration};

/// Frames of a scan and their distance.
const N_FRAMES: usize = 100;
const STEP_MM: f64 = 0.5;

/// Median σ of a point, mm, used for the verdicts: matt grey paint at this station.
const MEDIAN_SIGMA_MM: f64 = 0.02;

/// Half the pixels of a typical station in either direction: scans take a quarter of the time.
fn station(seed: u64) -> StationModel {
    let shape = StationShape { width_px: 640, height_px: 512, line_sigma_px: 1.5, ..StationShape::default() };
    StationModel::seeded(seed, &shape).unwrap()
}

/// The watches' results for a scan of `scene` by `model`, whose stage travels `1 + scale` times the stated distance.
fn watched(calibration: &Calibration, model: &StationModel, scene: &Scene, scale: f64, noise: u64) -> WatchReport {
    watched_over(calibration, model, scene, (N_FRAMES, STEP_MM), scale, noise)
}

/// The same with a given number and distance of frames.
fn watched_over(
    calibration: &Calibration,
    model: &StationModel,
    scene: &Scene,
    (n_frames, step_mm): (usize, f64),
    scale: f64,
    noise: u64,
) -> WatchReport {
    let renderer = Renderer::new(model);
    let frame = |idx: usize| {
        let said_mm = (idx as f64 - 0.5 * n_frames as f64) * step_mm;
        let image = renderer.laser_image(scene, said_mm * (1.0 + scale), noise * 1000 + idx as u64);
        let centrelines = find_centrelines(&image, &CentrelineParams::default());
        ScanFrame { centrelines, position: StagePosition::LinearMm(said_mm) }
    };
    let frames: Vec<ScanFrame> = (0..n_frames).into_par_iter().map(frame).collect();
    let frames = &frames[..];
    let evaluation = evaluate_scan(&frames, calibration, &ScanParams::default()).unwrap();
    watch_scan(&evaluation, calibration).unwrap().unwrap()
}

fn verdict(report: &WatchReport, watch: Watch) -> WatchVerdict {
    verdict_by(report, watch, None)
}

fn verdict_by(report: &WatchReport, watch: Watch, reference: Option<&PowerReference>) -> WatchVerdict {
    verdicts(report, MEDIAN_SIGMA_MM, reference).into_iter().find(|verdict| verdict.watch == watch).unwrap()
}

fn is_warning(verdict: &WatchVerdict) -> bool {
    matches!(verdict.state, WatchState::Warning | WatchState::Invalid)
}

#[test]
fn a_drifting_wavelength_is_reported_with_the_equivalent_tilt() {
    let model = station(7);
    let calibration = random_calibration(&model, 7);
    let mut warm = model.clone();
    warm.grating.wavelength_over_period *= 1.0 + 1.5e-3;
    let report = watched(&calibration, &warm, &SceneKind::Freeform.placed(&model, 0x100), 0.0, 1);
    let wavelength = report.drift.unwrap().wavelength.unwrap();
    eprintln!("{:?}", report.drift);
    assert!((wavelength.value - 1.5e-3).abs() < 4.0 * wavelength.sigma, "{wavelength:?}");
    let verdict = verdict(&report, Watch::Wavelength);
    // 1.5e-3 is a nanometre of 660: some 100 µm of depth at the outer orders.
    assert_eq!(verdict.state, WatchState::Invalid, "{verdict:?}");
    assert!(verdict.reason.contains("not corrected: a stage tilted by"), "{verdict:?}");
}

#[test]
fn a_stage_that_travels_more_than_it_states_is_detected_on_slopes() {
    let model = station(7);
    let calibration = random_calibration(&model, 8);
    let report = watched(&calibration, &model, &egg_carton(&model), 6e-3, 1);
    let scale = report.drift.unwrap().stage_scale.unwrap();
    eprintln!("{:?}", report.drift);
    assert!((scale.value - 6e-3).abs() < 4.0 * scale.sigma, "{scale:?}");
    let verdict = verdict(&report, Watch::StageScale);
    assert!(is_warning(&verdict), "{verdict:?}");
}

#[test]
fn on_a_plate_lost_steps_and_scale_are_reported_as_blind() {
    let model = station(7);
    let calibration = random_calibration(&model, 7);
    let report = watched(&calibration, &model, &SceneKind::Plate.placed(&model, 0x100), 4e-3, 1);
    for watch in [Watch::LostSteps, Watch::StageScale] {
        let verdict = verdict(&report, watch);
        assert_eq!(verdict.state, WatchState::Blind, "{verdict:?}");
        assert!(verdict.reason.contains("slopes"), "{verdict:?}");
    }
    assert!(report.drift.unwrap().wavelength.is_some());
}

/// Powers from scans of different parts, as after a calibration.
fn reference(model: &StationModel, calibration: &Calibration) -> PowerReference {
    let parts = [SceneKind::Freeform, SceneKind::Plate];
    let scans: Vec<OrderPowers> = (0..5)
        .map(|idx| {
            let scene = parts[idx % 2].placed(model, 0x100 + idx as u64);
            watched(calibration, model, &scene, 0.0, 10 + idx as u64).powers.unwrap()
        })
        .collect();
    PowerReference::of(&scans).unwrap()
}

#[test]
fn dirt_a_rotated_grating_and_an_ageing_laser_are_distinguished_by_the_powers() {
    let model = station(7);
    let calibration = random_calibration(&model, 7);
    let reference = reference(&model, &calibration);
    eprintln!("{reference:?}");
    let scene = SceneKind::Freeform.placed(&model, 0x180);
    let by = |change: fn(f64) -> f64| {
        let mut changed = model.clone();
        for (power, order) in changed.order_powers.iter_mut().zip(&model.orders) {
            *power *= change(f64::from(*order));
        }
        let report = watched(&calibration, &changed, &scene, 0.0, 1);
        verdict_by(&report, Watch::OrderPowers, Some(&reference))
    };
    let clean = by(|_| 1.0);
    assert_eq!(clean.state, WatchState::Quiet, "{clean:?}");
    let dirty = by(|order| 1.0 - 0.15 * order.abs());
    assert!(is_warning(&dirty) && dirty.reason.contains("dirty"), "{dirty:?}");
    let turned = by(|order| 1.0 + 0.15 * order);
    assert!(is_warning(&turned) && turned.reason.contains("rotated"), "{turned:?}");
    let aged = by(|_| 0.6);
    assert!(is_warning(&aged) && aged.reason.contains("laser ages"), "{aged:?}");
    // 60 % of the light.
    assert!((aged.estimate.unwrap().value - 0.6f64.ln()).abs() < 0.1, "{aged:?}");
}

/// A scan of a station without drift, of hills or of an egg carton.
fn clean(seed: u64) -> WatchReport {
    let model = station(seed);
    let scene =
        if seed.is_multiple_of(2) { egg_carton(&model) } else { SceneKind::Freeform.placed(&model, 0x100 + seed) };
    watched(&random_calibration(&model, 0x500 + seed), &model, &scene, 0.0, seed)
}

/// Watches that warn on a clean scan; powers are tested separately.
fn false_warnings(report: &WatchReport) -> Vec<WatchVerdict> {
    verdicts(report, MEDIAN_SIGMA_MM, None).into_iter().filter(is_warning).collect()
}

#[test]
fn clean_scans_raise_no_warning() {
    // One of hills, one of an egg carton; the rate of false warnings is the campaign's.
    for seed in 1..=2 {
        let report = clean(seed);
        let warnings = false_warnings(&report);
        assert!(warnings.is_empty(), "{seed}: {warnings:?}");
    }
}

/// Stations of the campaign, their scans for the reference powers, and their tested scans.
const STATIONS: u64 = 20;
const REFERENCE_SCANS: u64 = 5;
const N_TESTED_SCANS: u64 = 10;

/// Largest fraction of scans with a false alarm of a watch, among those in which it is not blind.
const FALSE_ALARM_RATE: f64 = 0.01;

/// Scans in which a watch was not blind, was blind, and warned.
#[derive(Debug, Default)]
struct WatchCounts {
    n_seeing: usize,
    n_blind: usize,
    n_warnings: usize,
}

/// A clean scan of a small station, of hills or of an egg carton: a quarter of the pixels and half the frames of the other
/// tests, over the same travel.
fn fast_clean(model: &StationModel, calibration: &Calibration, scan: u64) -> WatchReport {
    let part = 0x100 + scan;
    let scene = if scan.is_multiple_of(2) { egg_carton(model) } else { SceneKind::Freeform.placed(model, part) };
    watched_over(calibration, model, &scene, (N_FRAMES / 2, 2.0 * STEP_MM), 0.0, scan)
}

#[test]
#[ignore = "takes minutes; 200 scans of 20 stations, or of N_STATIONS"]
fn a_campaign_of_clean_scans() {
    let n_stations = std::env::var("N_STATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(STATIONS);
    let mut counts = [Watch::LostSteps, Watch::Wavelength, Watch::OrderPowers, Watch::StageScale]
        .map(|watch| (watch, WatchCounts::default()));
    let (mut of_wavelength, mut of_scale) = (Vec::new(), Vec::new());
    for seed in 100..100 + n_stations {
        let shape = StationShape { width_px: 320, height_px: 256, line_sigma_px: 1.0, ..StationShape::default() };
        let model = StationModel::seeded(seed, &shape).unwrap();
        let calibration = random_calibration(&model, 0x500 + seed);
        let powers = (0..REFERENCE_SCANS).filter_map(|scan| fast_clean(&model, &calibration, 50 + scan).powers);
        let reference = PowerReference::of(&powers.collect::<Vec<_>>());
        for scan in 0..N_TESTED_SCANS {
            let report = fast_clean(&model, &calibration, seed * 100 + scan);
            let drift = report.drift.as_ref();
            of_wavelength.extend(drift.and_then(|drift| drift.wavelength).map(|of| of.value / of.sigma));
            of_scale.extend(drift.and_then(|drift| drift.stage_scale).map(|of| of.value / of.sigma));
            for verdict in verdicts(&report, MEDIAN_SIGMA_MM, reference.as_ref()) {
                let Some((_, count)) = counts.iter_mut().find(|(watch, _)| *watch == verdict.watch) else {
                    continue;
                };
                match verdict.state {
                    WatchState::Blind => count.n_blind += 1,
                    _ => count.n_seeing += 1,
                }
                if is_warning(&verdict) {
                    count.n_warnings += 1;
                    eprintln!("station {seed}, scan {scan}: {verdict:?}");
                }
            }
        }
        eprintln!("station {seed}: {counts:?}");
    }
    let rms = |of: &[f64]| (of.iter().map(|v| v * v).sum::<f64>() / of.len() as f64).sqrt();
    eprintln!(
        "{} clean scans: {counts:?}; whitened RMS of λ {:.2} over {}, of scale {:.2} over {}",
        n_stations * N_TESTED_SCANS,
        rms(&of_wavelength),
        of_wavelength.len(),
        rms(&of_scale),
        of_scale.len()
    );
    for (watch, count) in counts {
        let most = FALSE_ALARM_RATE * count.n_seeing as f64;
        assert!(count.n_warnings as f64 <= most, "{watch:?}: {} of {}", count.n_warnings, count.n_seeing);
        // Few bins and coarse steps determine neither small losses nor the scale; there these watches must say so.
        let may_be_blind = matches!(watch, Watch::LostSteps | Watch::StageScale);
        assert!(may_be_blind || count.n_seeing > count.n_blind, "{watch:?} is blind in {} scans", count.n_blind);
    }
}
