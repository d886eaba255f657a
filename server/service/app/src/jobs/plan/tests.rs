//! Plans and refusals for the default simulated station, with its true parameters as the calibration. That the
//! predicted σ is met is tested by actual scans.

use crate::error::ErrorKind;
use devices::{
    CameraCapabilities, CameraSettings, DeviceIdentity, LaserCapabilities, PixelFormat, Roi, StageCapabilities,
    Trigger, ValueRange,
};
use nalgebra::DMatrix;
use optics::{DepthRangeMm, LightSurfaces};
use station::{DeviceStatus, LaserLight, MachineState, OperationalState};
use twin::{StationModel, StationShape};

use super::*;
use crate::jobs::ScanSource;
use crate::resources::measurements::{MeasureInput, ScanPurpose};
use crate::resources::scan_run::ScanSettings;

fn calibration() -> Calibration {
    let model = StationModel::seeded(7, &StationShape::default()).unwrap();
    let light = LightSurfaces::Grating(model.grating);
    let n = 9 + light.parameters() + 3;
    Calibration {
        id: "true".into(),
        camera: model.camera,
        orders: model.orders,
        light,
        stage: Some(model.stage),
        depth_range_mm: DepthRangeMm { near_mm: 360.0, far_mm: 424.0 },
        covariance: DMatrix::zeros(n, n),
    }
}

fn device<C>(capabilities: C) -> DeviceStatus<C> {
    let [vendor, model, serial, firmware] = std::array::from_fn(|_| String::new());
    let identity = DeviceIdentity { driver: "twin", vendor, model, serial, firmware };
    DeviceStatus { connected: true, identity, capabilities }
}

fn status() -> StationStatus {
    let range = |min, max| Some(ValueRange { min, max });
    let camera = CameraCapabilities {
        sensor_px: (1280, 1024),
        exposure_us: range(10.0, 1e6),
        gain_db: None,
        frame_rate_hz: range(0.1, 120.0),
        triggers: vec![Trigger::Free, Trigger::Software],
        pixel_formats: vec![PixelFormat::Mono8],
        roi: false,
    };
    let stage = StageCapabilities {
        kind: devices::StageKind::Linear,
        travel_mm: (-100.0, 100.0),
        max_speed_mm_s: 100.0,
        acceleration_mm_s2: Some(500.0),
        homing: devices::Homing::Required,
        resolution_mm: 1e-6,
        follows_frames: false,
        frame_pitch_mm: None,
    };
    StationStatus {
        state: MachineState::Operational(OperationalState::Ready),
        activity: String::new(),
        simulated: Some("twin"),
        camera: device(camera),
        camera_settings: CameraSettings {
            exposure_us: 20_000.0,
            gain_db: 0.0,
            frame_rate_hz: 30.0,
            trigger: Trigger::Software,
            pixel_format: PixelFormat::Mono8,
            roi: Roi { left_px: 0, top_px: 0, width_px: 1280, height_px: 1024 },
        },
        dark_frame_use: station::DarkFrameUse::NoDarkFrame,
        frame_rate_hz: 0.0,
        stage: device(stage),
        position_mm: Some(0.0),
        moving: false,
        homed: true,
        laser: device(LaserCapabilities { switched: true, power: range(0.01, 1.0), interlock: true }),
        laser_lost_host: None,
        laser_light: LaserLight::Off,
        laser_power: 0.0,
        interlock_closed: Some(true),
        job_id: None,
        faults: Vec::new(),
        state_history: Default::default(),
        frames_arrived: 0,
        frames_dropped: Vec::new(),
    }
}

fn input(from_mm: f64, to_mm: f64) -> ScanInput {
    ScanInput {
        source: ScanSource::Station,
        name: None,
        settings: ScanSettings { from_mm: Some(from_mm), to_mm: Some(to_mm), ..ScanSettings::default() },
        calibration_id: None,
        resume_scan_id: None,
        measure: Vec::new(),
        purpose: ScanPurpose::Production,
    }
}

/// Defaults for a machine that has not scanned yet.
fn pace(input: &ScanInput) -> Pace {
    Pace::unknown(input.settings.mode())
}

fn planned(change: impl FnOnce(&mut ScanSettings)) -> Result<ScanPlan, AppError> {
    let mut input = input(-20.0, 20.0);
    change(&mut input.settings);
    plan(&input, &calibration(), &status(), &pace(&input))
}

#[test]
fn forty_millimetres_in_fifths_are_two_hundred_and_one_rows() {
    let plan = planned(|_| {}).unwrap();
    assert_eq!(
        (plan.mode, plan.n_rows, plan.range.step, plan.exposure_us),
        (ScanMode::StopAndGo, 201, 0.2, 1_000.0)
    );
    assert_eq!(
        (plan.range.position(0).value(), plan.range.position(1).value(), plan.range.position(200).value()),
        (-20.0, -19.8, 20.0)
    );
    // 0.2 mm at 500 mm/s²: 2·√(0.2/500) = 40 ms; exposure 1 ms; overhead; approach of 20 mm in 0.4 s.
    let row_s = 0.04 + 0.001 + params::ROW_OVERHEAD_S;
    assert!((plan.acquisition_s - (0.4 + 201.0 * row_s)).abs() < 1e-9, "{}", plan.acquisition_s);
    let evaluation_s = 201.0 * params::EVALUATION_S_PER_FRAME;
    assert!((plan.duration_s - plan.acquisition_s - evaluation_s).abs() < 1e-9, "{}", plan.duration_s);
    // Five rows per mm, and 1280 px over 203.4 mm at 400 mm.
    assert!((plan.rows_per_mm - 5.0).abs() < 0.05, "{}", plan.rows_per_mm);
    let pitch = 1280.0 / 203.4 * 400.0 / 392.0;
    assert!((plan.points_per_mm_along_line / pitch - 1.0).abs() < 0.02, "{}", plan.points_per_mm_along_line);
    assert_eq!((plan.n_orders, plan.max_points), (5, 201 * 5 * 1280));
    let sigma_mm = plan.predicted_sigma_mm.unwrap();
    assert!((0.005..0.08).contains(&sigma_mm), "{sigma_mm}");
    assert_eq!(plan.depth_mm, [360.0, 424.0]);
}

#[test]
fn a_range_may_be_reversed_and_may_have_one_row() {
    let back = planned(|input| (input.from_mm, input.to_mm) = (Some(1.0), Some(0.0))).unwrap();
    assert_eq!((back.n_rows, back.range.position(5).value()), (6, 0.0));
    let one = planned(|input| input.to_mm = input.from_mm).unwrap();
    assert_eq!((one.n_rows, one.range.position(0).value()), (1, -20.0));
    let odd = planned(|input| input.step_mm = Some(0.3)).unwrap();
    assert_eq!((odd.n_rows, odd.range.position(133).value()), (134, 19.9));
}

#[test]
fn speed_step_and_frame_rate_of_a_continuous_scan_follow_from_each_other() {
    let plan = planned(|input| input.speed_mm_s = Some(6.0)).unwrap();
    assert_eq!((plan.mode, plan.range.speed, plan.frame_rate_hz), (ScanMode::Continuous, Some(6.0), Some(30.0)));
    assert!((plan.range.step - 0.2).abs() < 1e-12);
    let plan = planned(|input| input.mode = Some(ScanMode::Continuous)).unwrap();
    assert_eq!((plan.range.speed, plan.range.step), (Some(6.0), 0.2));
    let plan = planned(|input| (input.speed_mm_s, input.step_mm) = (Some(6.0), Some(0.1))).unwrap();
    assert_eq!((plan.frame_rate_hz, plan.n_rows), (Some(60.0), 401));
    // 40 mm at 6 mm/s, two ramps of 12 ms, the approach.
    assert!((6.5..8.0).contains(&plan.acquisition_s), "{}", plan.acquisition_s);
}

#[test]
fn the_plan_uses_the_durations_of_recent_scans() {
    let measure = MeasureInput {
        tool: "sphere".into(),
        name: None,
        nominal_mm: None,
        tolerance_mm: None,
        region_mm: None,
        seed: None,
    };
    let input = ScanInput { measure: vec![measure.clone(), measure], ..input(-20.0, 20.0) };
    let slow = Pace { row_overhead_s: 0.25, evaluation_s_per_frame: 0.05, measuring_s: 2.0, passes: 3.0 };
    let plan = plan(&input, &calibration(), &status(), &slow).unwrap();
    // 201 rows of 0.041 s of motion and exposure, 0.4 s of approach.
    let expected_s = 0.4 + 201.0 * (0.041 + 0.25) + 201.0 * 0.05 + 2.0 * 2.0;
    assert!((plan.duration_s - expected_s).abs() < 1e-9, "{}", plan.duration_s);
}

#[test]
fn invalid_input_is_refused_with_its_place_and_a_remedy() {
    let check = |change: &dyn Fn(&mut ScanSettings), place: &str, words: &str| {
        let problem = planned(|input| change(input)).unwrap_err();
        assert_eq!(
            (problem.kind, problem.pointer.as_deref()),
            (ErrorKind::Impossible, Some(place)),
            "{problem:?}"
        );
        assert!(problem.detail.contains(words), "{problem:?}");
        assert!(problem.remedy.is_some(), "{problem:?}");
    };
    check(&|input| input.from_mm = None, "/from_mm", "needs from_mm");
    check(&|input| input.to_mm = Some(f64::NAN), "/to_mm", "NaN");
    check(&|input| input.step_mm = Some(0.0), "/step_mm", "step_mm is 0");
    check(&|input| input.step_mm = Some(-0.2), "/step_mm", "step_mm is -0.2");
    check(&|input| input.step_mm = Some(1e-5), "/step_mm", "below");
    check(&|input| input.step_mm = Some(0.01), "/step_mm", "4001 rows");
    check(&|input| input.to_mm = Some(120.0), "/to_mm", "outside the stage's travel");
    check(&|input| (input.to_mm, input.speed_mm_s) = (Some(99.9), Some(20.0)), "/to_mm", "run-up");
    check(&|input| input.speed_mm_s = Some(150.0), "/speed_mm_s", "maximum speed of the stage is 100 mm/s");
    check(&|input| (input.speed_mm_s, input.step_mm) = (Some(90.0), Some(0.1)), "/step_mm", "900.0 frames/s");
    check(
        &|input| (input.speed_mm_s, input.mode) = (Some(5.0), Some(ScanMode::StopAndGo)),
        "/speed_mm_s",
        "stop-and-go",
    );
    check(
        &|input| (input.mode, input.to_mm) = (Some(ScanMode::Continuous), Some(-20.0)),
        "/to_mm",
        "needs a range",
    );
    check(&|input| input.exposure_us = Some(1.0), "/exposure_us", "10 to 1000000");
    check(
        &|input| (input.exposure_us, input.speed_mm_s) = (Some(50_000.0), Some(3.0)),
        "/exposure_us",
        "does not fit",
    );
    check(&|input| input.laser_power = Some(1.5), "/laser_power", "power 1.5");
}

#[test]
fn a_calibration_of_another_camera_or_without_a_stage_is_refused() {
    let mut other = calibration();
    other.stage = None;
    let problem = plan(&input(-1.0, 1.0), &other, &status(), &Pace::unknown(ScanMode::StopAndGo)).unwrap_err();
    assert!(problem.detail.contains("no stage direction"), "{problem:?}");
    other.camera.width_px = 640;
    let problem = plan(&input(-1.0, 1.0), &other, &status(), &Pace::unknown(ScanMode::StopAndGo)).unwrap_err();
    assert!(problem.detail.contains("1280×1024 pixels"), "{problem:?}");
}

#[test]
fn a_plan_needs_a_connected_stage() {
    let mut status = status();
    status.stage.connected = false;
    let problem =
        plan(&input(-1.0, 1.0), &calibration(), &status, &Pace::unknown(ScanMode::StopAndGo)).unwrap_err();
    assert_eq!(
        (problem.kind, problem.detail.as_str()),
        (ErrorKind::DeviceFault, "the station's stage is not connected")
    );
}

#[test]
fn motion_blur_and_an_unhomed_stage_are_noted() {
    let mut status = status();
    status.homed = false;
    let mut input = input(-20.0, 20.0);
    (input.settings.speed_mm_s, input.settings.exposure_us) = (Some(6.0), Some(20_000.0));
    let notes = plan(&input, &calibration(), &status, &pace(&input)).unwrap().notes.join(" ");
    assert!(notes.contains("home it") && notes.contains("0.120 mm during an exposure"), "{notes}");
}

#[test]
fn kept_images_count_as_files_and_once_more_in_their_archive() {
    let without = planned(|_| {}).unwrap().disk_bytes;
    let with = planned(|input| input.keep_frames = true).unwrap().disk_bytes;
    assert_eq!(with - without, 2 * 201 * 1280 * 1024);
}

#[test]
fn a_recording_is_scanned_row_by_row_in_its_own_steps() {
    let mut status = status();
    (status.simulated, status.stage.capabilities.resolution_mm) = (Some("replay"), 2.08);
    let planned = |change: &dyn Fn(&mut ScanSettings)| {
        let mut input = input(-15.6, 15.6);
        change(&mut input.settings);
        plan(&input, &calibration(), &status, &pace(&input))
    };
    let own = planned(&|_| {}).unwrap();
    assert_eq!((own.range.step, own.n_rows, own.range.position(15).value()), (2.08, 16, 15.6));
    let fine = planned(&|input| input.step_mm = Some(0.2)).unwrap_err();
    assert_eq!(fine.pointer.as_deref(), Some("/step_mm"));
    assert!(fine.detail.contains("stage resolution of 2.08 mm"), "{fine:?}");
}

#[test]
fn a_sweep_over_a_recording_takes_its_own_frames_without_run_up() {
    let mut status = status();
    let stage = &mut status.stage.capabilities;
    (stage.follows_frames, stage.resolution_mm, stage.travel_mm) = (true, 2.08, (-15.6, 15.6));
    let planned = |change: &dyn Fn(&mut ScanSettings)| {
        let mut input = input(-15.6, 15.6);
        change(&mut input.settings);
        plan(&input, &calibration(), &status, &pace(&input))
    };
    let whole = planned(&|input| input.mode = Some(ScanMode::Continuous)).unwrap();
    assert_eq!((whole.range.step, whole.n_rows, whole.frame_rate_hz), (2.08, 16, Some(30.0)));
    let slow = planned(&|input| input.speed_mm_s = Some(10.4)).unwrap();
    assert_eq!((slow.range.step, slow.n_rows, slow.frame_rate_hz), (2.08, 16, Some(5.0)));
    let fine =
        planned(&|input| (input.mode, input.step_mm) = (Some(ScanMode::Continuous), Some(0.2))).unwrap_err();
    assert_eq!(fine.pointer.as_deref(), Some("/step_mm"));
    assert!(fine.detail.contains("2.08 mm apart"), "{fine:?}");
}

/// A station with a turntable, and its true calibration.
fn turning() -> (StationStatus, Calibration) {
    let mut status = status();
    let stage = &mut status.stage.capabilities;
    (stage.kind, stage.travel_mm) = (devices::StageKind::Rotary, (-400.0, 400.0));
    let mut calibration = calibration();
    let shape = StationShape { stage: optics::StageKind::Rotary, ..StationShape::default() };
    calibration.stage = Some(StationModel::seeded(7, &shape).unwrap().stage);
    let n = calibration.covariance.nrows() + 1;
    calibration.covariance = DMatrix::zeros(n, n);
    (status, calibration)
}

fn turn(change: impl Fn(&mut ScanSettings)) -> Result<ScanPlan, AppError> {
    let (status, calibration) = turning();
    let mut input = input(0.0, 0.0);
    input.settings = ScanSettings { from_deg: Some(0.0), to_deg: Some(375.0), ..ScanSettings::default() };
    change(&mut input.settings);
    plan(&input, &calibration, &status, &pace(&input))
}

#[test]
fn a_turntable_scan_is_planned_in_degrees() {
    let plan = turn(|input| input.step_deg = Some(1.5)).unwrap();
    assert_eq!((plan.n_rows, plan.range.position(1)), (251, optics::StagePosition::RotaryDeg(1.5)));
    // Half-way between the axis at 400 mm and the nearest depth at 360 mm: radius 20 mm, 0.52 mm per 1.5°.
    assert!((plan.rows_per_mm - 1.91).abs() < 0.1, "{plan:?}");
    assert!(plan.notes.iter().all(|note| !note.contains("how well")), "{:?}", plan.notes);
    let part = turn(|input| input.to_deg = Some(90.0)).unwrap();
    assert!(part.notes.iter().any(|note| note.contains("closure of a turn")), "{:?}", part.notes);
    let sweep = turn(|input| input.speed_deg_s = Some(15.0)).unwrap();
    assert_eq!((sweep.mode, sweep.range.step, sweep.n_rows), (ScanMode::Continuous, 0.5, 751));
}

#[test]
fn a_range_in_the_unit_of_the_other_stage_is_refused_by_name() {
    let refused = |change: &dyn Fn(&mut ScanSettings)| {
        let problem = turn(change).unwrap_err();
        (problem.pointer.unwrap_or_default(), problem.detail)
    };
    let (field, detail) = refused(&|input| input.from_mm = Some(1.0));
    assert!(field == "/from_mm" && detail.contains("stage turns"), "{field} {detail}");
    let (field, detail) = refused(&|input| input.to_deg = Some(500.0));
    assert!(
        field == "/to_deg" && detail.contains("500° is outside the stage's travel of -400°"),
        "{field} {detail}"
    );
    let mut degrees = input(-20.0, 20.0);
    degrees.settings.step_deg = Some(1.0);
    let problem = plan(&degrees, &calibration(), &status(), &pace(&degrees)).unwrap_err();
    assert_eq!(problem.pointer.as_deref(), Some("/step_deg"));
}

#[test]
fn a_calibration_of_the_other_kind_of_stage_is_refused() {
    let (status, _) = turning();
    let mut turn = input(0.0, 0.0);
    turn.settings = ScanSettings { from_deg: Some(0.0), to_deg: Some(90.0), ..ScanSettings::default() };
    let problem = plan(&turn, &calibration(), &status, &pace(&turn)).unwrap_err();
    assert!(problem.detail.contains("linear stage, the station's stage is rotary"), "{problem:?}");
}

#[test]
fn a_laser_that_is_always_on_is_noted_in_the_plan() {
    let mut status = status();
    status.laser.capabilities.switched = false;
    let input = input(-20.0, 20.0);
    let planned = plan(&input, &calibration(), &status, &pace(&input)).unwrap();
    assert!(
        planned.notes.iter().any(|note| note.contains("not controlled by this station")),
        "{:?}",
        planned.notes
    );
}

#[test]
fn rows_of_several_exposures_take_their_sum_and_are_refused_where_they_cannot_be() {
    let one = planned(|input| input.exposure_us = Some(9_000.0)).unwrap();
    let three = planned(|input| input.exposures_us = vec![9_000.0, 250.0, 1_500.0]).unwrap();
    assert_eq!((three.exposure_us, three.exposures_us.as_slice()), (9_000.0, &[250.0, 1_500.0, 9_000.0][..]));
    // Two more exposures with their overhead.
    let more_s = 201.0 * ((250.0 + 1_500.0) * 1e-6 + 2.0 * params::ROW_OVERHEAD_S);
    assert!((three.acquisition_s - one.acquisition_s - more_s).abs() < 1e-9, "{}", three.acquisition_s);
    let refused = |exposures_us: &[f64], change: fn(&mut ScanSettings)| {
        let problem = planned(|input| {
            input.exposures_us = exposures_us.to_vec();
            change(input);
        });
        problem.unwrap_err().pointer
    };
    let place = Some("/exposures_us".to_owned());
    assert_eq!(refused(&[1_000.0], |_| {}), place);
    assert_eq!(refused(&[1.0, 10.0, 100.0, 1e3, 1e4], |_| {}), place);
    assert_eq!(refused(&[1_000.0, 1_200.0], |_| {}), place);
    assert_eq!(refused(&[1_000.0, 1e12], |_| {}), place);
    assert_eq!(refused(&[1_000.0, f64::NAN], |_| {}), place);
    assert_eq!(refused(&[250.0, 1_500.0], |input| input.exposure_us = Some(1_000.0)), place);
    assert_eq!(refused(&[250.0, 1_500.0], |input| input.keep_frames = true), place);
    assert_eq!(refused(&[250.0, 1_500.0], |input| input.speed_mm_s = Some(2.0)), place);
}
