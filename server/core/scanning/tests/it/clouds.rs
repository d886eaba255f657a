//! Scans with ghosts, ambiguous lines, poor models and bad input.

use crate::common::planes::fitted_planes;
use crate::common::scene::{Noise, scan};
use crate::common::{KnownScan, SIGMA_PX, assert_labelled, station};
use optics::{DepthRangeMm, LightSurfaces, StagePosition, Triangulator};
use remedy::Remedy;
use scanning::{DropReason, ScanError, ScanParams, label_frame, scan_cloud};
use vision::{CentrelinePoint, Segment};

fn positions(n: usize, step_mm: f64) -> Vec<f64> {
    (0..n).map(|i| (i as f64 - (n - 1) as f64 / 2.0) * step_mm).collect()
}

fn step(x: f64, y: f64) -> f64 {
    if x.abs() < 14.0 && y.abs() < 10.0 { 391.0 } else { 400.0 }
}

fn add_ghost(known: &mut KnownScan, frame: usize, u: std::ops::Range<usize>, row: impl Fn(f64) -> f64) {
    let point = |u_px: usize| CentrelinePoint {
        u_px: u_px as f64,
        v_px: row(u_px as f64),
        normal: [0.0, 1.0],
        sigma_px: SIGMA_PX,
        intensity: 20.0,
        width_px: 5.0,
        saturated: false,
    };
    known.orders[frame].push(vec![None; u.len()]);
    known.frames[frame].centrelines.segments.push(Segment { points: u.map(point).collect() });
}

#[test]
fn reflections_are_dropped_and_counted() {
    // A stationary reflection, one that moves against the travel, and random pieces.
    let station = station(5, false);
    let mut known = scan(&station, &step, &positions(24, 1.2), false);
    let mut noise = Noise(3);
    for frame in 0..24 {
        add_ghost(&mut known, frame, 150..260, |_| 236.0);
        add_ghost(&mut known, frame, 420..520, |u| 330.0 - 2.0 * frame as f64 + 0.05 * u);
        for _ in 0..4 {
            let (u, v) = (300.0 + 90.0 * noise.next(), 256.0 + 60.0 * noise.next());
            add_ghost(&mut known, frame, u.max(0.0) as usize..u.max(0.0) as usize + 12, |_| v);
        }
    }
    let result = assert_labelled("ghosts", &known, &station, 0.97);
    assert!(result.report.dropped.n_pieces(DropReason::Contradicted) >= 48);
}

#[test]
fn plane_models_give_correct_labels_too() {
    // Planes fitted to each sheet miss its bow by several tenths of a millimetre.
    let exact = station(5, false);
    let station = fitted_planes(&exact);
    let sphere = |x: f64, y: f64| {
        let squared = 18.9f64.powi(2) - x * x - y * y;
        if squared > 0.0 { 381.1 - squared.sqrt() } else { 400.0 }
    };
    for surface in [&step as &(dyn Fn(f64, f64) -> f64 + Sync), &sphere] {
        assert_labelled("planes", &scan(&exact, surface, &positions(24, 1.2), false), &station, 0.97);
    }
}

#[test]
fn a_travel_shorter_than_the_line_pitch_is_labelled_if_all_lines_are_visible() {
    let station = station(5, false);
    // The block's top, 4 % of the points, is short and observed by one order only, so it is rejected.
    assert_labelled("short", &scan(&station, &step, &positions(5, 1.0), false), &station, 0.97);
}

#[test]
fn nine_orders_over_a_high_part_are_labelled() {
    let station = station(9, false);
    let part = |x: f64, y: f64| {
        let squared = 25f64.powi(2) - (x + 10.0).powi(2) - y * y;
        if squared > 0.0 { 395.0 - squared.sqrt() } else { 410.0 + 0.1 * x }
    };
    assert_labelled("nine", &scan(&station, &part, &positions(20, 1.3), false), &station, 0.97);
}

#[test]
fn one_frame_is_labelled_within_the_envelope_and_doubtful_beyond() {
    let station = station(5, false);
    // A narrow bar: one or two lines, so that ranks are no evidence.
    let bar = |_: f64, y: f64| if y.abs() < 4.0 { 400.0 } else { f64::INFINITY };
    let known = scan(&station, &bar, &[0.0], false);
    let lines = &known.frames[0].centrelines;
    let tables = Triangulator::new(station.clone());
    let narrow = label_frame(lines, &tables, DepthRangeMm { near_mm: 390.0, far_mm: 410.0 });
    assert_eq!(narrow.points.len(), known.n_true());
    assert!(
        narrow
            .points
            .iter()
            .all(|p| Some(p.order) == known.order_at(0, p.centreline.u_px as f32, p.centreline.v_px as f32))
    );
    let wide = label_frame(lines, &tables, DepthRangeMm { near_mm: 340.0, far_mm: 460.0 });
    assert_eq!(wide.points.len(), 0);
    assert_eq!(wide.dropped.n_points(DropReason::Doubtful), known.n_true());
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let station = station(5, false);
    let known = scan(&station, &step, &positions(8, 2.0), false);
    let with = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| scan_cloud(&known.frames, &station, &ScanParams::default()).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn points_are_sorted_by_frame_then_order_then_along_the_line() {
    let station = station(5, true);
    let known = scan(&station, &|_, _| 400.0, &positions(3, 2.0), true);
    let cloud = scan_cloud(&known.frames, &station, &ScanParams::default()).unwrap().cloud;
    assert!(cloud.points.is_sorted_by_key(|p| (p.frame, p.order, p.v_px.round() as i64)));
    assert!(cloud.comments.contains(&"calibration test".to_string()));
}

#[test]
fn input_that_cannot_be_evaluated_is_refused_with_the_remedy() {
    let station = station(5, false);
    let known = scan(&station, &|_, _| 400.0, &positions(3, 2.0), false);
    let params = ScanParams::default();
    assert_eq!(scan_cloud(&[], &station, &params).unwrap_err(), ScanError::NoFrames);
    let without_stage = optics::Calibration { stage: None, ..station.clone() };
    let refusal = scan_cloud(&known.frames, &without_stage, &params).unwrap_err();
    assert!(refusal.remedy().unwrap().contains("stage views"), "{refusal}");
    assert!(scan_cloud(&known.frames[..1], &without_stage, &params).is_ok());
    let mut lost = known.frames.clone();
    lost[1].position = StagePosition::LinearMm(f64::NAN);
    assert_eq!(scan_cloud(&lost, &station, &params).unwrap_err(), ScanError::BadPosition { frame: 1 });
    let params = ScanParams { depth_range_mm: Some(DepthRangeMm { near_mm: 410.0, far_mm: 390.0 }) };
    assert!(matches!(scan_cloud(&known.frames, &station, &params), Err(ScanError::BadDepthRange { .. })));
}

#[test]
fn a_scan_without_lines_gives_an_empty_cloud() {
    let station = station(5, false);
    let mut known = scan(&station, &|_, _| 400.0, &positions(3, 2.0), false);
    known.frames.iter_mut().for_each(|frame| frame.centrelines.segments.clear());
    let result = scan_cloud(&known.frames, &station, &ScanParams::default()).unwrap();
    assert_eq!((result.cloud.points.len(), result.report.dropped.total_points()), (0, 0));
}

#[test]
fn self_consistency_shows_a_miscalibrated_grating() {
    let true_station = station(5, false);
    let known = scan(&true_station, &|_, _| 400.0, &positions(16, 2.0), false);
    let largest_bias_mm = |calibration: &optics::Calibration| {
        let result = scan_cloud(&known.frames, calibration, &ScanParams::default()).unwrap();
        assert!(result.report.self_consistency.len() >= 4);
        result.report.self_consistency.iter().map(|pair| pair.bias_mm.abs()).fold(0.0, f64::max)
    };
    let mut wrong = true_station.clone();
    if let LightSurfaces::Grating(grating) = &mut wrong.light {
        grating.wavelength_over_period *= 1.003;
    }
    let (good, bad) = (largest_bias_mm(&true_station), largest_bias_mm(&wrong));
    eprintln!("largest bias: true {good:.4} mm, wavelength 0.3 % off {bad:.4} mm");
    // 0.3 % of one order's 23 mm of depth is 70 µm; noise leaves 1 µm in a mean.
    assert!(good < 0.01 && bad > 0.03, "{good} {bad}");
}
