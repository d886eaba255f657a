//! The simulated station through the device traits: it fulfils the contract, and images show the commanded state.
//!
//! Not covered: that real cameras, stages and lasers fail only in these ways.

use std::time::{Duration, Instant};

use devices::contract::{self, Cable, CameraProfile, LaserProfile, StageProfile, Stopwatch};
use devices::{
    Camera, CameraError, CameraRequest, FrameInfo, Laser, LaserError, PixelFormat, Stage, StageError, StageState,
    Trigger,
};
use twin::live::{BOARD_EXPOSURE_US, LASER_EXPOSURE_US};
use twin::poses::board_poses;
use twin::{
    Scene, SceneKind, StationModel, StationShape, Timing, TwinCamera, TwinControl, TwinFault, TwinLaser,
    TwinOptions, TwinStage, TwinStation,
};
use vision::{CentrelineMethod, CentrelineParams, GreyImage, LineDirection, Pixels, find_centrelines};

/// Longest wait for an expected event.
const WAIT_LIMIT: Duration = Duration::from_secs(20);

const LEASE: Duration = Duration::from_secs(1);

/// A station small enough to be rendered in a few milliseconds.
fn model() -> StationModel {
    let shape = StationShape { width_px: 320, height_px: 256, ..StationShape::default() };
    StationModel::seeded(11, &shape).unwrap()
}

fn options(timing: Timing) -> TwinOptions {
    TwinOptions { timing, travel_mm: (-5.0, 5.0), ..TwinOptions::default() }
}

/// A station with its software trigger set and acquisition started.
struct Bench {
    camera: TwinCamera,
    stage: TwinStage,
    laser: TwinLaser,
    control: TwinControl,
    image: GreyImage,
}

impl Bench {
    fn new() -> Self {
        Self::of(model())
    }

    fn of(model: StationModel) -> Self {
        let station = TwinStation::new(model, TwinOptions::default());
        let (mut camera, stage, laser) = station.devices();
        let wanted = CameraRequest { trigger: Some(Trigger::Software), ..CameraRequest::default() };
        camera.configure(&wanted).unwrap();
        camera.start().unwrap();
        Self { camera, stage, laser, control: station.control(), image: blank() }
    }

    fn exposure(&mut self, exposure_us: f64) {
        let wanted = CameraRequest { exposure_us: Some(exposure_us), ..CameraRequest::default() };
        self.camera.configure(&wanted).unwrap();
    }

    fn set_laser(&mut self, power: f64) {
        self.exposure(LASER_EXPOSURE_US);
        self.laser.switch_on(power, LEASE).unwrap();
    }

    fn grab(&mut self) -> FrameInfo {
        self.camera.trigger().unwrap();
        self.camera.next_frame(&mut self.image, WAIT_LIMIT).unwrap().unwrap()
    }

    fn laser_grab(&mut self) -> GreyImage {
        self.set_laser(1.0);
        self.grab();
        self.image.clone()
    }

    fn go(&mut self, target_mm: f64) -> Result<StageState, StageError> {
        self.stage.start_move(target_mm, 1e6).unwrap();
        rest(&mut self.stage)
    }
}

fn rest(stage: &mut TwinStage) -> Result<StageState, StageError> {
    let begin = Instant::now();
    loop {
        let state = stage.poll()?;
        if !state.moving {
            return Ok(state);
        }
        assert!(begin.elapsed() < WAIT_LIMIT);
    }
}

fn blank() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap()
}

fn mean(image: &GreyImage) -> f64 {
    let Pixels::Eight(pixels) = image.pixels() else { panic!("8 bits were requested") };
    pixels.iter().map(|&level| f64::from(level)).sum::<f64>() / pixels.len() as f64
}

fn cable(control: &TwinControl, fault: TwinFault) -> Option<Cable> {
    let (out, back) = (control.clone(), control.clone());
    Some(Cable {
        unplug: Box::new(move || out.set_fault(fault)),
        replug: Box::new(move || assert!(back.clear_fault(fault.name()))),
    })
}

fn check_stage(timing: Timing, speed_mm_s: f64) {
    let station = TwinStation::new(model(), options(timing));
    let profile = StageProfile {
        speed_mm_s,
        tolerance_mm: 1e-9,
        instant: false,
        motion_limit: Duration::from_secs(5),
        rest_limit: Duration::from_millis(500),
        reset_button: None,
        cable: cable(&station.control(), TwinFault::StageUnplugged),
    };
    contract::stage(&mut || Box::new(station.stage()), &profile);
}

#[test]
fn the_instant_stage_passes_the_suite() {
    check_stage(Timing::Instant, 50.0);
}

#[test]
fn the_realistic_stage_passes_the_suite() {
    check_stage(Timing::Realistic, 50.0);
}

#[test]
fn the_camera_passes_the_suite_with_either_timing() {
    for timing in [Timing::Instant, Timing::Realistic] {
        let station = TwinStation::new(model(), options(timing));
        let profile = CameraProfile {
            frame_rate_hz: Some(60.0),
            frame_limit: Duration::from_secs(3),
            cable: cable(&station.control(), TwinFault::CameraUnplugged),
        };
        contract::camera(&mut || Box::new(station.camera()), &profile);
    }
}

#[test]
fn the_laser_passes_the_suite() {
    let station = TwinStation::new(model(), options(Timing::Instant));
    let control = station.control();
    let profile = LaserProfile {
        light: Some(Box::new(move || control.laser_power() > 0.0)),
        reaction_limit: Duration::from_millis(20),
        cable: cable(&station.control(), TwinFault::LaserUnplugged),
    };
    contract::laser(&mut || Box::new(station.laser()), &profile);
}

#[test]
fn nominal_exposures_give_the_images_of_a_recording() {
    // Without noise two images of the same scene are equal irrespective of their number, and so must be the levels.
    const NOISE_OF_THE_MEAN: f64 = 0.02; // 1.2 levels over 82 000 pixels, five standard deviations
    let mut bench = Bench::new();
    let renderer = bench.control.renderer();
    let board = Scene::Board(board_poses(&model(), 1).remove(0));
    bench.control.place(board.clone());
    bench.exposure(BOARD_EXPOSURE_US);
    bench.grab();
    let recorded = renderer.board_image(&board, 0.0, 1);
    assert!((mean(&bench.image) - mean(&recorded)).abs() < 4.0 * NOISE_OF_THE_MEAN);
    bench.laser_grab();
    let recorded = renderer.laser_image(&board, 0.0, 1);
    // Speckle: contrast 0.3 over some 2 000 grains of a tenth of the image.
    assert!((mean(&bench.image) - mean(&recorded)).abs() < 0.05 * (mean(&recorded) - 3.0));
}

#[test]
fn grey_levels_follow_exposure_gain_and_power_up_to_saturation() {
    const BLACK: f64 = 3.0;
    let mut bench = Bench::new();
    bench.control.place_part(&SceneKind::Plate);
    let level = |bench: &mut Bench, exposure_us: f64| {
        bench.exposure(exposure_us);
        bench.grab();
        mean(&bench.image) - BLACK
    };
    let nominal = level(&mut bench, BOARD_EXPOSURE_US);
    let half = level(&mut bench, BOARD_EXPOSURE_US / 2.0);
    assert!((half / nominal - 0.5).abs() < 0.002, "{half} of {nominal}"); // rounding of levels is 0.001
    let gain = CameraRequest { gain_db: Some(6.0), ..CameraRequest::default() };
    bench.camera.configure(&gain).unwrap();
    let amplified = level(&mut bench, BOARD_EXPOSURE_US / 2.0);
    assert!((amplified / half - 10.0_f64.powf(0.3)).abs() < 0.004, "{amplified} of {half}");
    assert_eq!(level(&mut bench, 20.0 * BOARD_EXPOSURE_US), 255.0 - BLACK);
    bench.camera.configure(&CameraRequest { gain_db: Some(0.0), ..gain }).unwrap();
    bench.set_laser(1.0);
    bench.grab();
    let full = mean(&bench.image) - BLACK;
    bench.set_laser(0.5);
    bench.grab();
    let dimmed = mean(&bench.image) - BLACK;
    assert!((dimmed / full - 0.5).abs() < 0.05, "{dimmed} of {full}");
}

#[test]
fn stop_and_go_repeats_byte_by_byte_regardless_of_earlier_motions() {
    let scan = |detour: bool| {
        let mut bench = Bench::new();
        if detour {
            bench.control.place_part(&SceneKind::Plate);
            bench.go(3.0).unwrap();
            bench.grab();
            bench.laser_grab();
            bench.control.place_part(&SceneKind::Sphere { radius_mm: 18.9 });
        }
        let take = |position_mm: f64| {
            bench.go(position_mm).unwrap();
            bench.laser_grab()
        };
        [-0.4, -0.2, 0.0].map(take)
    };
    let plain = scan(false);
    assert!(plain == scan(true));
    assert!(plain[0] != plain[1]);
}

#[test]
fn a_second_exposure_of_the_same_scene_has_other_noise() {
    let mut bench = Bench::new();
    let first = bench.laser_grab();
    assert!(first != bench.laser_grab());
}

#[test]
fn centrelines_of_frames_lie_on_the_truth() {
    // Speckle of contrast 0.3 moves a centre by some 0.1 px; the mean over hundreds of columns is far better.
    const MEAN_TOLERANCE_PX: f64 = 0.02;
    const RMS_TOLERANCE_PX: f64 = 0.25;
    let mut bench = Bench::of(StationModel::seeded(3, &StationShape::default()).unwrap());
    bench.control.place_part(&SceneKind::Gauge { height_mm: 8.9 });
    bench.go(2.5).unwrap();
    let image = bench.laser_grab();
    let truth = bench.control.renderer().truth_points(&bench.control.scene(), bench.control.true_position_mm());
    let params = CentrelineParams { method: CentrelineMethod::default(), line_direction: LineDirection::Rows };
    let lines = find_centrelines(&image, &params);
    let found = lines.segments.iter().flat_map(|segment| &segment.points);
    let errors: Vec<f64> = found
        .filter_map(|point| {
            // The neighbouring column as well: where a line ends at the block's edge, the last point found may lie one
            // column beyond the last ray that still hits the table.
            let of_column = truth.iter().filter(|truth| (truth.u_px - point.u_px).abs() <= 1.5);
            of_column.map(|truth| point.v_px - truth.v_px).min_by(|a, b| a.abs().total_cmp(&b.abs()))
        })
        .collect();
    let n = errors.len() as f64;
    let (mean, rms) = (errors.iter().sum::<f64>() / n, (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt());
    assert!(n > 4.0 * 1280.0, "{n} points");
    assert!(mean.abs() < MEAN_TOLERANCE_PX && rms < RMS_TOLERANCE_PX, "mean {mean} px, rms {rms} px");
}

#[test]
fn the_end_of_a_lease_turns_the_laser_off_in_the_image() {
    let mut bench = Bench::new();
    let lit = mean(&bench.laser_grab());
    bench.laser.renew(Duration::from_millis(30)).unwrap();
    let begin = Instant::now();
    while bench.laser.poll().unwrap().emitting {
        assert!(begin.elapsed() < WAIT_LIMIT);
    }
    bench.grab();
    // The board illumination is on instead of the laser; 1 000 µs of it give 5 % of its levels.
    let Pixels::Eight(pixels) = bench.image.pixels() else { panic!("8 bits were requested") };
    assert!(lit > 4.0 && *pixels.iter().max().unwrap() < 30, "{lit}");
}

#[test]
fn frames_not_collected_are_overrun_and_counted() {
    let station = TwinStation::new(model(), TwinOptions::default());
    let mut camera = station.camera();
    camera.configure(&CameraRequest { frame_rate_hz: Some(120.0), ..CameraRequest::default() }).unwrap();
    camera.start().unwrap();
    let mut image = blank();
    let mut next_id = 0;
    let mut lost = 0;
    for round in 0..12 {
        if round == 2 {
            std::thread::sleep(Duration::from_millis(400));
        }
        let info = camera.next_frame(&mut image, WAIT_LIMIT).unwrap().unwrap();
        assert_eq!(info.frame_id, next_id + info.lost_before, "every gap is counted");
        next_id = info.frame_id + 1;
        lost += info.lost_before;
    }
    assert!(lost > 0, "nothing was overrun in 400 ms");
}

#[test]
fn lost_frames_are_gaps() {
    let mut bench = Bench::new();
    bench.control.set_fault("lost_frames=3".parse().unwrap());
    (0..6).for_each(|_| bench.camera.trigger().unwrap());
    let next = |bench: &mut Bench| {
        let info = bench.camera.next_frame(&mut bench.image, WAIT_LIMIT).unwrap().unwrap();
        (info.frame_id, info.lost_before)
    };
    assert_eq!([next(&mut bench), next(&mut bench), next(&mut bench)], [(0, 0), (1, 0), (3, 1)]);
}

#[test]
fn frames_of_another_format_are_refused_until_the_fault_is_cleared() {
    for (fault, expected) in [(TwinFault::WrongFrameSize, (320, 128)), (TwinFault::WrongPixelFormat, (640, 256))] {
        let mut bench = Bench::new();
        bench.control.set_fault(fault);
        bench.camera.trigger().unwrap();
        let refused = bench.camera.next_frame(&mut bench.image, WAIT_LIMIT);
        let Err(CameraError::WrongFrame { got_width_px, got_height_px, .. }) = refused else {
            panic!("{refused:?}")
        };
        assert_eq!((got_width_px, got_height_px), expected);
        bench.control.clear_fault(fault.name());
        bench.grab();
    }
}

#[test]
fn a_camera_that_hangs_reports_nothing() {
    let mut bench = Bench::new();
    bench.control.set_fault(TwinFault::CameraHang);
    bench.camera.trigger().unwrap();
    let nothing = bench.camera.next_frame(&mut bench.image, Duration::from_millis(50));
    assert!(matches!(nothing, Ok(None)), "{nothing:?}");
    bench.control.clear_fault("camera_hang");
    bench.grab();
}

#[test]
fn a_stalled_stage_reports_it_until_it_is_acknowledged_and_homed() {
    let mut bench = Bench::new();
    bench.control.set_fault(TwinFault::StageStall { at_mm: 5.0 });
    for _ in 0..2 {
        let stalled = if bench.stage.poll().is_ok() { bench.go(20.0) } else { bench.stage.poll() };
        let Err(StageError::Stalled { target_mm, actual_mm }) = stalled else { panic!("{stalled:?}") };
        assert!(target_mm == 20.0 && (actual_mm - 5.0).abs() < 0.02, "{actual_mm}");
    }
    assert!((bench.control.true_position_mm() - 5.0).abs() < 0.02);
    bench.stage.clear_fault().unwrap();
    assert_eq!(bench.stage.poll().unwrap().position_mm, None);
    assert!(matches!(bench.stage.start_move(0.0, 1e6), Err(StageError::NotHomed)));
    bench.stage.start_home().unwrap();
    assert!(matches!(bench.go(20.0), Err(StageError::Stalled { .. })), "the obstacle is still there");
    bench.control.clear_fault("stage_stall");
    bench.stage.clear_fault().unwrap();
    bench.stage.start_home().unwrap();
    assert_eq!(bench.go(20.0).unwrap().position_mm, Some(20.0));
}

#[test]
fn lost_steps_are_visible_only_in_the_images() {
    let mut bench = Bench::new();
    bench.go(1.0).unwrap();
    let before = bench.laser_grab();
    bench.go(3.0).unwrap();
    assert!(bench.laser_grab() != before);
    bench.control.set_fault(TwinFault::LostSteps { lost_mm: 0.5 });
    assert_eq!(bench.go(1.5).unwrap().position_mm, Some(1.5));
    assert_eq!(bench.control.true_position_mm(), 1.0);
    assert!(bench.laser_grab() == before);
    bench.stage.start_home().unwrap();
    assert_eq!(rest(&mut bench.stage).unwrap().position_mm, Some(1.0));
    assert_eq!(bench.control.faults(), []);
}

#[test]
fn a_silent_stage_is_detected_within_a_second() {
    let mut bench = Bench::new();
    bench.control.set_fault(TwinFault::StageSilent);
    let watch = Stopwatch::start();
    while bench.stage.poll().is_ok() {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(watch.own_time() < Duration::from_secs(1)); // promises.md: serial faults
    assert!(matches!(bench.stage.clear_fault(), Err(StageError::NoResponse { .. })));
    bench.control.clear_fault("stage_silent");
    assert!(
        matches!(bench.stage.poll(), Err(StageError::NoResponse { .. })),
        "the fault persists until the stage is reconnected"
    );
    bench.stage.reconnect().unwrap();
    assert_eq!(bench.stage.poll().unwrap().position_mm, None);
}

#[test]
fn a_faulty_laser_is_off() {
    let mut bench = Bench::new();
    bench.set_laser(1.0);
    bench.control.set_fault(TwinFault::InterlockOpen);
    assert_eq!(bench.control.laser_power(), 0.0);
    assert_eq!(bench.laser.poll().unwrap().interlock_closed, Some(false));
    assert!(matches!(bench.laser.switch_on(1.0, LEASE), Err(LaserError::InterlockOpen)));
    bench.control.clear_fault("interlock_open");
    assert!(!bench.laser.poll().unwrap().emitting);
    bench.set_laser(1.0);
    bench.control.set_fault(TwinFault::LaserFault);
    assert_eq!(bench.control.laser_power(), 0.0);
    assert!(matches!(bench.laser.poll(), Err(LaserError::Fault { .. })));
    bench.control.clear_fault("laser_fault");
    assert!(matches!(bench.laser.poll(), Err(LaserError::Fault { .. })));
    bench.laser.reconnect().unwrap();
    assert!(!bench.laser.poll().unwrap().emitting);
}

#[test]
fn wavelength_drift_moves_the_outer_lines_and_is_reversible() {
    let mut bench = Bench::new();
    let before = bench.laser_grab();
    let row = |bench: &Bench, order: i8| {
        let truth = bench.control.renderer().truth_points(&bench.control.scene(), 0.0);
        let of_order: Vec<f64> = truth.iter().filter(|p| p.order == order).map(|p| p.v_px).collect();
        of_order.iter().sum::<f64>() / of_order.len() as f64
    };
    let (cold, cold_axis) = (row(&bench, 2), row(&bench, 0));
    bench.control.set_fault(TwinFault::WavelengthDrift { relative: 0.01 });
    let moved = (row(&bench, 2) - cold).abs();
    // A hundredth of the 25 mm between the orders at 400 mm is a quarter of a millimetre.
    assert!((0.1..2.0).contains(&moved), "{moved} px");
    assert!((row(&bench, 0) - cold_axis).abs() < 0.02);
    assert!(bench.laser_grab() != before);
    bench.control.clear_fault("wavelength_drift");
    bench.go(1.0).unwrap();
    bench.go(0.0).unwrap();
    assert_eq!(row(&bench, 2), cold);
}

#[test]
fn a_dirty_grating_dims_the_lines_and_scatters_light() {
    let mut bench = Bench::new();
    bench.control.place_part(&SceneKind::Plate);
    let brightest_and_darkest = |image: &GreyImage| {
        let Pixels::Eight(pixels) = image.pixels() else { panic!("8 bits were requested") };
        let mut sorted = pixels.clone();
        sorted.sort_unstable();
        (sorted[sorted.len() * 98 / 100], sorted[sorted.len() / 4])
    };
    let clean = brightest_and_darkest(&bench.laser_grab());
    bench.control.set_fault(TwinFault::DirtyGrating { fraction: 0.5 });
    let dirty = brightest_and_darkest(&bench.laser_grab());
    assert!(dirty.0 < clean.0 && dirty.1 > clean.1 + 5, "{clean:?} {dirty:?}");
}

#[test]
fn sixteen_bits_show_the_same_image_as_eight() {
    let mut bench = Bench::new();
    bench.grab();
    let eight = bench.image.clone();
    let wanted = CameraRequest { pixel_format: Some(PixelFormat::Mono16), ..CameraRequest::default() };
    bench.camera.configure(&wanted).unwrap();
    bench.grab();
    assert_eq!(bench.image.bit_depth(), 16);
    let worst = (0..320).map(|u| (bench.image.at(u, 90) / 257.0 - eight.at(u, 90)).abs()).fold(0.0, f32::max);
    // Two noises of 2.5 levels each.
    assert!(worst < 15.0, "{worst}");
}

#[test]
fn the_carriage_follows_an_external_stage() {
    let bench = Bench::new();
    bench.control.follow_stage(|_| 7.25);
    bench.control.follow_laser(|_| 0.5);
    assert_eq!(bench.control.true_position_mm(), 7.25);
    assert_eq!(bench.control.laser_power(), 0.5);
}
