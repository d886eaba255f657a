//! The calls of a lease, and how they end.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use devices::CameraRequest;
use devices::contract::Stopwatch;

use super::bench::{bench, never_cancelled, wait_until};
use crate::shared::cancel::CancelFlag;
use crate::{LaserLight, MachineState, Manual, OperationalState, StationRefusal, Sweep};

/// The twin moves at constant speed and its readings are exact, so only rounding remains.
const STAMP_TOLERANCE_MM: f64 = 1e-6;

const SWEEP: Sweep = Sweep { from_mm: -2.0, to_mm: 3.0, speed_mm_s: 5.0, frame_rate_hz: 30.0 };

#[test]
fn a_job_moves_exposes_and_leaves_everything_as_it_was() {
    let bench = bench();
    let before = bench.station.status().camera_settings;
    let lease = bench.lease();
    assert_eq!(bench.station.status().state, MachineState::Operational(OperationalState::SingleExecution));
    let accepted =
        lease.configure(&CameraRequest { exposure_us: Some(1000.0), ..CameraRequest::default() }).unwrap();
    assert_eq!(accepted.exposure_us, 1000.0);
    lease.laser_on(0.5).unwrap();
    assert!(bench.control.laser_power() > 0.0, "the call comes back with the light on");
    assert_eq!(lease.move_to(12.5, None, &never_cancelled()).unwrap(), 12.5);
    let frame = lease.grab(&never_cancelled()).unwrap();
    assert_eq!((frame.position_mm, frame.laser_on, frame.exposure_us), (Some(12.5), true, 1000.0));
    lease.laser_off().unwrap();
    assert!(!lease.grab(&never_cancelled()).unwrap().laser_on);
    lease.laser_on(1.0).unwrap();
    drop(lease);
    assert_eq!(bench.control.laser_power(), 0.0, "the end of the lease turns it off");
    let status = bench.station.status();
    assert_eq!(status.camera_settings, before);
    assert_eq!(status.state, MachineState::Operational(OperationalState::Ready));
    assert_eq!(status.laser_light, LaserLight::Off);
}

#[test]
fn frames_are_numbered_without_gaps_and_in_time() {
    let bench = bench();
    let lease = bench.lease();
    let frames: Vec<_> = (0..20).map(|_| lease.grab(&never_cancelled()).unwrap()).collect();
    for pair in frames.windows(2) {
        assert_eq!(pair[1].sequence, pair[0].sequence + 1);
        assert!(pair[1].captured_at_ns > pair[0].captured_at_ns);
    }
}

#[test]
fn a_sweep_delivers_every_frame_of_its_range_with_its_position() {
    let bench = bench();
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    let stream = lease.sweep(&SWEEP, &never_cancelled()).unwrap();
    let frames: Vec<_> = stream.frames.iter().collect();
    assert!(stream.end_reason().is_none());
    assert_eq!(stream.dropped.total(), 0);
    let positions: Vec<f64> = frames.iter().map(|frame| frame.position_mm.unwrap()).collect();
    assert!(positions.iter().all(|position| (-2.0..=3.0).contains(position)), "{positions:?}");
    assert!(positions.windows(2).all(|pair| pair[1] > pair[0]), "{positions:?}");
    // 5 mm at 5 mm/s and 30 Hz are 30 frames; a simulated sensor on a busy machine exposes more slowly.
    assert!((5..=31).contains(&frames.len()), "{} frames", frames.len());
    for pair in frames.windows(2) {
        let seconds = (pair[1].captured_at - pair[0].captured_at).as_secs_f64();
        let off_mm = (pair[1].position_mm.unwrap() - pair[0].position_mm.unwrap()) - seconds * SWEEP.speed_mm_s;
        assert!(off_mm.abs() < STAMP_TOLERANCE_MM, "the stamped position is {off_mm} mm off its time");
    }
    assert!(frames.iter().all(|frame| frame.laser_on));
    drop(frames);
    lease.laser_off().unwrap();
    assert_eq!(lease.move_to(0.0, None, &never_cancelled()).unwrap(), 0.0);
}

#[test]
fn a_sweep_can_run_backwards() {
    let bench = bench();
    let lease = bench.lease();
    let stream = lease.sweep(&Sweep { from_mm: 3.0, to_mm: -2.0, ..SWEEP }, &never_cancelled()).unwrap();
    let positions: Vec<f64> = stream.frames.iter().map(|frame| frame.position_mm.unwrap()).collect();
    assert!(positions.windows(2).all(|pair| pair[1] < pair[0]), "{positions:?}");
    assert!((5..=31).contains(&positions.len()), "{} frames", positions.len());
}

#[test]
fn a_sweep_whose_run_up_exceeds_the_travel_is_refused_before_anything_moves() {
    let bench = bench();
    let lease = bench.lease();
    let refused = lease.sweep(&Sweep { from_mm: -100.0, ..SWEEP }, &never_cancelled());
    assert!(matches!(refused, Err(StationRefusal::Stage(devices::StageError::OutOfTravel { .. }))));
    assert_eq!(bench.control.true_position_mm(), 0.0);
    for speed_mm_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = lease.sweep(&Sweep { speed_mm_s, ..SWEEP }, &never_cancelled());
        assert!(matches!(refused, Err(StationRefusal::Stage(devices::StageError::BadNumber { .. }))));
    }
    assert!(lease.grab(&never_cancelled()).is_ok(), "a refusal is not a fault");
}

#[test]
fn frames_lost_by_a_slow_recorder_are_counted() {
    let bench = bench();
    let lease = bench.lease();
    let sweep = Sweep { from_mm: 0.0, to_mm: 60.0, speed_mm_s: 20.0, frame_rate_hz: 100.0 };
    let stream = lease.sweep(&sweep, &never_cancelled()).unwrap();
    wait_until("over", || !bench.station.status().moving);
    let delivered: Vec<u64> = stream.frames.iter().map(|frame| frame.sequence).collect();
    assert_eq!(delivered.len(), crate::params::RECORDER_FRAMES);
    assert!(delivered.windows(2).all(|pair| pair[1] == pair[0] + 1), "the first ones, in order");
    let dropped = stream.dropped.recorder.load(Ordering::Relaxed);
    assert!(dropped > 0 && dropped == stream.dropped.total(), "{:?}", stream.dropped);
    let shown = ("recorder", dropped);
    bench.wait_for("counted", |status| status.frames_dropped.contains(&shown));
}

#[test]
fn stop_ends_the_pending_call_and_all_later_ones() {
    let bench = bench();
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    std::thread::scope(|scope| {
        let moving = scope.spawn(|| lease.move_to(90.0, Some(10.0), &never_cancelled()));
        bench.wait_for("moving", |status| status.moving);
        bench.stop();
        let ended = moving.join().unwrap();
        assert!(matches!(&ended, Err(StationRefusal::Stopped { actor }) if actor == "a person"), "{ended:?}");
    });
    assert_eq!(bench.control.laser_power(), 0.0);
    assert_eq!(bench.station.status().state, MachineState::Halted);
    assert!(matches!(lease.grab(&never_cancelled()), Err(StationRefusal::Stopped { .. })));
    assert!(bench.control.true_position_mm() < 80.0, "it stopped during the move");
    assert!(matches!(bench.try_lease().map(drop), Err(StationRefusal::Halted)));
    bench.manual(Manual::Reset).unwrap();
    let next = bench.lease();
    assert_eq!(bench.station.status().state, MachineState::Operational(OperationalState::SingleExecution));
    drop(lease);
    assert_eq!(
        next.move_to(1.0, None, &never_cancelled()).unwrap(),
        1.0,
        "the old lease's end does not touch the new one"
    );
}

#[test]
fn stop_ends_a_sweep_with_its_reason() {
    let bench = bench();
    let lease = bench.lease();
    let stream = lease.sweep(&SWEEP, &never_cancelled()).unwrap();
    bench.stop();
    assert!(stream.frames.iter().count() < 20);
    assert!(matches!(stream.end_reason(), Some(StationRefusal::Stopped { .. })));
}

#[test]
fn calls_of_a_cancelled_job_return_at_once() {
    let bench = bench();
    let lease = bench.lease();
    let cancel = CancelFlag::default();
    std::thread::scope(|scope| {
        let moving = scope.spawn(|| lease.move_to(90.0, Some(10.0), &cancel));
        bench.wait_for("moving", |status| status.moving);
        let watch = Stopwatch::start();
        cancel.cancel();
        assert!(matches!(moving.join().unwrap(), Err(StationRefusal::Cancelled)));
        // Far below the 9 s of the move.
        assert!(watch.own_time() < Duration::from_secs(2));
    });
    bench.wait_for("at rest", |status| !status.moving);
    assert!(matches!(lease.grab(&cancel), Err(StationRefusal::Cancelled)));
    assert!(lease.grab(&never_cancelled()).is_ok(), "the lease continues: only the call was cancelled");
}

#[test]
fn a_second_job_is_refused_while_one_has_the_station() {
    let bench = bench();
    let lease = bench.lease();
    lease.activity("scanning, row 3 of 9");
    bench.wait_for("the activity", |status| status.activity == "scanning, row 3 of 9");
    assert!(matches!(bench.try_lease(), Err(StationRefusal::Busy { activity }) if activity.contains("row 3")));
    drop(lease);
    assert!(bench.try_lease().is_ok());
}

#[test]
fn light_is_suspended_while_the_job_is_idle_and_resumes_with_its_next_exposure() {
    let bench = bench();
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    let off_after = wait_until("laser off", || bench.control.laser_power() == 0.0);
    assert!(off_after < Duration::from_secs(1), "off after {off_after:?}");
    assert!(lease.grab(&never_cancelled()).unwrap().laser_on);
}

#[test]
fn a_motion_or_a_wait_does_not_keep_the_laser_on() {
    let bench = bench();
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    std::thread::scope(|scope| {
        let moving = scope.spawn(|| lease.move_to(90.0, Some(20.0), &never_cancelled()));
        bench.wait_for("moving", |status| status.moving);
        wait_until("laser off", || bench.control.laser_power() == 0.0);
        assert!(!moving.is_finished(), "it goes off during the move");
        bench.stop();
        let _ = moving.join().unwrap();
    });
}

#[test]
fn the_laser_goes_off_half_a_second_after_a_hanging_cameras_frame_was_due() {
    let bench = bench();
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    assert!(lease.grab(&never_cancelled()).unwrap().laser_on);
    bench.control.set_fault(twin::TwinFault::CameraHang);
    let (requested, watch, lit) = (Instant::now(), Stopwatch::start(), std::sync::atomic::AtomicU64::new(0));
    let ended = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !ended.load(Ordering::SeqCst) {
                let before = Instant::now();
                let is_on = bench.control.laser_power() > 0.0;
                std::thread::sleep(Duration::from_millis(1));
                lit.fetch_add(if is_on { before.elapsed().as_micros() as u64 } else { 0 }, Ordering::SeqCst);
            }
        });
        let refused = lease.grab(&never_cancelled()).map(drop);
        ended.store(true, Ordering::SeqCst);
        assert!(matches!(refused, Err(StationRefusal::NoFrame { .. })), "{refused:?}");
    });
    // Two exposures were due; promised are 2 s to the name and 0.5 s of light after each.
    let took = watch.own_time();
    let late = requested.elapsed().saturating_sub(took);
    let lit = Duration::from_micros(lit.load(Ordering::SeqCst)).saturating_sub(late);
    assert!(took < Duration::from_secs(2), "reported after {took:?}");
    assert!(lit < Duration::from_millis(1200), "light for {lit:?}");
    assert_eq!(bench.control.laser_power(), 0.0);
}
