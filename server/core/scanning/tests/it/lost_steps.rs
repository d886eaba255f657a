//! Lost steps in the middle of rendered scans are detected; scans without losses raise no alarm. Not covered: other
//! speckle, working distances and steps of the stage.

use std::ops::Range;

use nalgebra::DMatrix;
use optics::{Calibration, DepthRangeMm, LightSurfaces, Triangulator};
use rayon::prelude::*;
use scanning::{LostSteps, LostStepsWatch, Profile, label_frame};
use twin::{Renderer, Scene, SceneKind, StationModel, StationShape};
use vision::{CentrelineParams, find_centrelines};

use crate::common::watched::{egg_carton, random_calibration};

/// Frames of a scan, their distance, and the frame from which steps are missing: by then the orders' surfaces overlap.
const N_FRAMES: usize = 110;
const STEP_MM: f64 = 0.5;
const LOST_AT: usize = 80;

/// Number of frames within which the loss must be detected.
const WITHIN_FRAMES: usize = 20;

/// The true calibration of the station.
fn calibration_of(model: &StationModel) -> Calibration {
    let mut orders = model.orders.clone();
    orders.sort_unstable();
    Calibration {
        id: "twin".into(),
        camera: model.camera,
        orders,
        light: LightSurfaces::Grating(model.grating),
        stage: Some(model.stage),
        depth_range_mm: DepthRangeMm { near_mm: 350.0, far_mm: 450.0 },
        covariance: DMatrix::from_diagonal_element(22, 22, 1e-10),
    }
}

/// A scan of a part by the station of that seed, with `lost_mm` missing from [`LOST_AT`] on.
struct Scan {
    calibration: Calibration,
    profiles: Vec<(Profile, f64)>,
}

fn scan(seed: u64, part: &SceneKind, lost_mm: f64) -> Scan {
    scan_of(seed, |model| part.placed(model, 0x100 + seed), lost_mm)
}

fn scan_of(seed: u64, scene: impl Fn(&StationModel) -> Scene, lost_mm: f64) -> Scan {
    let model = StationModel::seeded(seed, &StationShape::default()).unwrap();
    let calibration = calibration_of(&model);
    let scene = scene(&model);
    let before = frames(&model, &calibration, &scene, 0.0, 0..LOST_AT);
    let after = frames(&model, &calibration, &scene, lost_mm, LOST_AT..N_FRAMES);
    Scan { calibration, profiles: [before, after].concat() }
}

/// Frames of a scan of `scene` by a stage `lost_mm` behind, each with its stated position.
fn frames(
    model: &StationModel,
    calibration: &Calibration,
    scene: &Scene,
    lost_mm: f64,
    frames: Range<usize>,
) -> Vec<(Profile, f64)> {
    let (renderer, triangulator) = (Renderer::new(model), Triangulator::new(calibration.clone()));
    let profile = |frame: usize| {
        let said_mm = (frame as f64 - 0.5 * N_FRAMES as f64) * STEP_MM;
        let image = renderer.laser_image(scene, said_mm - lost_mm, model.seed * 1000 + frame as u64);
        let lines = find_centrelines(&image, &CentrelineParams::default());
        (label_frame(&lines, &triangulator, calibration.depth_range_mm), said_mm)
    };
    frames.into_par_iter().map(profile).collect()
}

impl Scan {
    fn alarms(&self) -> Vec<LostSteps> {
        let mut watch = LostStepsWatch::new(&self.calibration).unwrap();
        let mut reducer = watch.reducer();
        let note = |(profile, position_mm): &(Profile, f64)| {
            watch.note(reducer.reduce(profile, *position_mm)?, *position_mm)
        };
        self.profiles.iter().filter_map(note).collect()
    }
}

fn freeform(seed: u64, lost_mm: f64) -> Scan {
    scan(seed, &SceneKind::Freeform, lost_mm)
}

#[test]
fn a_loss_of_fifty_micrometres_is_detected_within_twenty_frames() {
    for (seed, lost_mm) in [(7, 0.05), (8, -0.05)] {
        let alarms = scan_of(seed, egg_carton, lost_mm).alarms();
        let [alarm] = alarms[..] else { panic!("{seed}: {} alarms", alarms.len()) };
        assert!((LOST_AT..LOST_AT + WITHIN_FRAMES).contains(&alarm.detected_frame), "{alarm:?}");
        assert!(alarm.first_frame.abs_diff(LOST_AT) <= 3, "{alarm:?}");
        assert!((alarm.lag_mm - lost_mm).abs() <= 4.0 * alarm.sigma_mm, "{alarm:?}");
    }
}

#[test]
fn a_scan_without_losses_raises_no_alarm() {
    // The rate of false alarms is the campaign's.
    let alarms = [freeform(1, 0.0).alarms(), scan_of(1, egg_carton, 0.0).alarms()].concat();
    assert!(alarms.is_empty(), "{alarms:?}");
}

#[test]
fn on_a_flat_plate_the_watch_is_blind_and_raises_no_alarm() {
    let alarms = scan(7, &SceneKind::Plate, 0.2).alarms();
    assert!(alarms.is_empty(), "{alarms:?}");
}

/// Clean scans per false alarm that the campaign allows.
const CLEAN_SCANS_PER_FALSE_ALARM: usize = 400;

#[test]
#[ignore = "takes half an hour; clean scans and losses of 50 µm for the seeds from FIRST_SEED to LAST_SEED"]
fn a_campaign_of_clean_and_faulty_scans() {
    let number =
        |name: &str, default: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default);
    let (mut n_clean, mut n_false, mut n_faulty, mut n_missed, mut n_wrong) = (0, 0, 0, 0, 0);
    for seed in number("FIRST_SEED", 100)..=number("LAST_SEED", 299) {
        let model = StationModel::seeded(seed, &StationShape::default()).unwrap();
        let calibration = random_calibration(&model, 0x500 + seed);
        let hills = SceneKind::Freeform.placed(&model, 0x100 + seed);
        let egg_carton = egg_carton(&model);
        let lost_mm = if seed % 2 == 0 { 0.05 } else { -0.05 };
        let before = frames(&model, &calibration, &egg_carton, 0.0, 0..LOST_AT);
        let after = |lost_mm| frames(&model, &calibration, &egg_carton, lost_mm, LOST_AT..N_FRAMES);
        let of = |profiles: Vec<(Profile, f64)>| Scan { calibration: calibration.clone(), profiles }.alarms();
        let clean = [
            of(frames(&model, &calibration, &hills, 0.0, 0..N_FRAMES)),
            of([before.clone(), after(0.0)].concat()),
        ];
        let faulty = of([before, after(lost_mm)].concat());
        let in_time =
            faulty.iter().find(|alarm| (LOST_AT..LOST_AT + WITHIN_FRAMES).contains(&alarm.detected_frame));
        n_clean += clean.len();
        n_false += clean.iter().filter(|alarms| !alarms.is_empty()).count();
        n_faulty += 1;
        n_missed += usize::from(in_time.is_none());
        n_wrong += usize::from(in_time.is_some_and(|alarm| (alarm.lag_mm - lost_mm).abs() > 4.0 * alarm.sigma_mm));
        eprintln!("{seed}: clean {clean:?}, faulty {faulty:?}");
    }
    eprintln!(
        "of {n_clean} clean scans {n_false} with a false alarm; of {n_faulty} with 50 µm lost {n_missed} not detected in time, {n_wrong} with a wrong size"
    );
    assert!(n_false * CLEAN_SCANS_PER_FALSE_ALARM <= n_clean, "{n_false} false alarms in {n_clean} clean scans");
    assert_eq!((n_missed, n_wrong), (0, 0));
}
