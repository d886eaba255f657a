//! Operation by a person: single commands, the live view, jogging.

use std::time::{Duration, Instant};

use devices::CameraRequest;
use devices::contract::Stopwatch;

use super::bench::{bench, bench_with, never_cancelled, small_devices, wait, wait_until};
use crate::station_thread::handle::Watch;
use crate::{LaserLight, LiveRequest, MachineState, Manual, OperationalState, StationRefusal};

const LIVE: LiveRequest = LiveRequest { running: true, laser_power: 0.5 };

#[test]
fn a_person_moves_homes_and_takes_a_snapshot() {
    let bench = bench();
    let accepted = bench.manual(Manual::Move { target_mm: 4.0, speed_mm_s: None }).unwrap().unwrap();
    assert_eq!(accepted.target_mm, 4.0);
    bench.wait_for("at the target", |status| status.position_mm == Some(4.0) && !status.moving);
    let frame = wait(bench.station.snapshot()).unwrap();
    assert_eq!((frame.position_mm, frame.laser_on), (Some(4.0), false));
    bench.manual(Manual::Home).unwrap();
    bench.wait_for("homed", |status| status.homed && !status.moving);
    let wanted = CameraRequest { exposure_us: Some(2000.0), ..CameraRequest::default() };
    bench.manual(Manual::Configure(wanted)).unwrap();
    bench.wait_for("set", |status| status.camera_settings.exposure_us == 2000.0);
}

#[test]
fn a_snapshot_leaves_the_camera_as_it_was() {
    let bench = bench();
    let before = bench.station.status().camera_settings;
    wait(bench.station.snapshot()).unwrap();
    wait(bench.station.snapshot()).unwrap();
    assert_eq!(bench.station.status().camera_settings, before);
}

#[test]
fn the_live_view_shows_frames_with_light_and_a_job_takes_over() {
    let bench = bench();
    let mut frames = bench.station.watch_frames();
    wait(bench.station.live(LIVE)).unwrap();
    assert_eq!(bench.station.status().state, MachineState::Operational(OperationalState::ContinuousExecution));
    for _ in 0..5 {
        wait(frames.changed()).unwrap();
    }
    bench.wait_for("laser on", |status| status.laser_light == LaserLight::On && status.frame_rate_hz > 0.0);
    let lease = bench.lease();
    assert_eq!(bench.control.laser_power(), 0.0, "the job decides about light");
    lease.grab(&never_cancelled()).unwrap();
    assert!(matches!(wait(bench.station.live(LIVE)), Err(StationRefusal::Busy { .. })));
}

#[test]
fn the_laser_of_an_unwatched_live_view_goes_off_before_the_view_ends_and_stays_off_for_a_returning_viewer() {
    let watch = Watch { light: Duration::from_millis(400), view: Duration::from_millis(1200) };
    let bench = bench_with(small_devices(), watch, false);
    bench.wait_for("ready", |status| status.activity == "ready");
    wait(bench.station.live(LIVE)).unwrap();
    for _ in 0..16 {
        bench.station.note_viewer(Instant::now());
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(bench.control.laser_power() > 0.0, "the laser stays on while the view is watched");
    let live = MachineState::Operational(OperationalState::ContinuousExecution);
    wait_until("laser off", || bench.control.laser_power() == 0.0);
    assert_eq!(bench.station.status().state, live, "the camera continues");
    for _ in 0..10 {
        bench.station.note_viewer(Instant::now());
        std::thread::sleep(Duration::from_millis(20));
        assert_eq!(bench.control.laser_power(), 0.0, "only a person turns the laser on again");
    }
    bench.manual(Manual::Laser { power: 0.5 }).unwrap();
    wait_until("laser on", || bench.control.laser_power() > 0.0);
    bench.wait_for("ended", |status| status.state == MachineState::Operational(OperationalState::Ready));
    assert_eq!(bench.control.laser_power(), 0.0);
}

#[test]
fn a_speed_outside_the_stages_range_is_refused() {
    let bench = bench();
    for speed_mm_s in [5e-324, 1e-9, 0.0, -1.0, 1e9, f64::INFINITY, f64::NAN] {
        let moved = bench.manual(Manual::Move { target_mm: 1.0, speed_mm_s: Some(speed_mm_s) });
        assert!(matches!(moved, Err(StationRefusal::SpeedOutOfRange { .. })), "{speed_mm_s}: {moved:?}");
    }
    let jogged = bench.manual(Manual::Jog { velocity_mm_s: -1e9 });
    assert!(matches!(jogged, Err(StationRefusal::SpeedOutOfRange { .. })), "{jogged:?}");
    assert_eq!(bench.control.true_position_mm(), 0.0);
}

#[test]
fn a_jog_stops_within_300_ms_of_the_last_command() {
    let bench = bench();
    let jog = Manual::Jog { velocity_mm_s: 20.0 };
    for _ in 0..4 {
        bench.manual(jog.clone()).unwrap();
        std::thread::sleep(Duration::from_millis(100));
        assert!(bench.station.status().moving, "it continues while it is repeated");
    }
    bench.manual(jog).unwrap();
    let watch = Stopwatch::start();
    let place = || bench.control.true_position_mm();
    loop {
        let before = place();
        std::thread::sleep(Duration::from_millis(5));
        if place() == before {
            break;
        }
    }
    let silent_for = watch.own_time();
    assert!(silent_for <= Duration::from_millis(300), "stopped {silent_for:?} after the last command");
    assert!(place() > 5.0, "it did jog");
}

#[test]
fn a_jog_of_zero_stops_at_once_and_another_direction_turns_back() {
    let bench = bench();
    bench.manual(Manual::Jog { velocity_mm_s: 20.0 }).unwrap();
    bench.wait_for("moving", |status| status.position_mm.is_some_and(|position| position > 0.5));
    bench.manual(Manual::Jog { velocity_mm_s: 0.0 }).unwrap();
    bench.wait_for("at rest", |status| !status.moving);
    let turned = bench.control.true_position_mm();
    wait_until("moving back", || {
        bench.manual(Manual::Jog { velocity_mm_s: -20.0 }).unwrap();
        bench.control.true_position_mm() < turned
    });
}

#[test]
fn a_stopped_station_refuses_commands_until_it_is_reset() {
    let bench = bench();
    wait(bench.station.live(LIVE)).unwrap();
    bench.stop();
    assert_eq!(bench.station.status().state, MachineState::Halted);
    assert_eq!(bench.control.laser_power(), 0.0);
    for command in [
        Manual::Home,
        Manual::Move { target_mm: 1.0, speed_mm_s: None },
        Manual::Jog { velocity_mm_s: 1.0 },
        Manual::Laser { power: 0.5 },
    ] {
        assert!(matches!(bench.manual(command.clone()), Err(StationRefusal::Halted)), "{command:?}");
    }
    assert!(matches!(wait(bench.station.live(LIVE)), Err(StationRefusal::Halted)));
    bench.manual(Manual::Reset).unwrap();
    assert_eq!(bench.station.status().state, MachineState::Operational(OperationalState::Ready));
    assert_eq!(bench.control.laser_power(), 0.0, "a reset leaves laser and motion off");
}

#[test]
fn manual_laser_control_needs_a_live_view() {
    let bench = bench();
    assert!(matches!(bench.manual(Manual::Laser { power: 0.5 }), Err(StationRefusal::NoLiveView)));
    assert_eq!(bench.control.laser_power(), 0.0);
    bench.manual(Manual::Laser { power: 0.0 }).unwrap();
}

#[test]
fn people_are_refused_while_a_job_has_the_station_but_may_stop_it() {
    let bench = bench();
    let lease = bench.lease();
    for command in [
        Manual::Home,
        Manual::Move { target_mm: 1.0, speed_mm_s: None },
        Manual::Configure(CameraRequest::default()),
        Manual::Laser { power: 0.0 },
    ] {
        assert!(matches!(bench.manual(command.clone()), Err(StationRefusal::Busy { .. })), "{command:?}");
    }
    bench.stop();
    assert!(matches!(lease.laser_on(1.0), Err(StationRefusal::Stopped { .. })));
}

#[test]
fn without_a_calibration_the_station_is_initialized_with_a_reason() {
    let bench = bench();
    bench.station.calibration_changed(false);
    let initialized = MachineState::Operational(OperationalState::Initialized);
    bench.wait_for("initialized", |status| status.state == initialized && status.activity == "not calibrated");
}
