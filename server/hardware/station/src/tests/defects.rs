//! Defects of this program and of drivers: light and motion end anyway.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use devices::CameraRequest;

use super::bench::{bench_of, never_cancelled, small_devices, wait, wait_until};
use super::spy_camera::{spied, spied_on_its_own_thread};
use crate::station_thread::handle::Watch;
use crate::{LiveRequest, MachineState, Manual, OperationalState, StationHandle, StationRefusal};

/// Promise 4 is 50 ms; the rest allows for a machine that runs other tests.
const STOP_LIMIT: Duration = Duration::from_millis(150);

#[test]
fn a_panic_in_the_thread_ends_light_and_motion_and_becomes_a_fault() {
    let (devices, spy) = spied(small_devices());
    let bench = bench_of(devices);
    bench.wait_for("ready", |status| status.activity == "ready");
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    spy.panics.store(true, Ordering::SeqCst);
    let ended = lease.grab(&never_cancelled());
    assert!(matches!(ended, Err(StationRefusal::InError { .. })), "{:?}", ended.map(|frame| frame.sequence));
    assert_eq!(bench.control.laser_power(), 0.0);
    bench.wait_for("in error", |status| {
        status.state == MachineState::Error && status.faults.iter().any(|fault| fault.kind == "panic")
    });
    drop(lease);
    bench.manual(Manual::Reset).unwrap();
    let state = bench.station.status().state;
    assert!(matches!(state, MachineState::Operational(OperationalState::Initialized)), "{state:?}");
    bench.manual(Manual::Home).unwrap();
    bench.wait_for("ready", |status| status.activity == "ready");
    bench.lease().grab(&never_cancelled()).unwrap();
}

#[test]
fn a_driver_that_hangs_cannot_keep_the_light_on() {
    let (devices, spy) = spied(small_devices());
    let bench = bench_of(devices);
    bench.wait_for("ready", |status| status.activity == "ready");
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    spy.frame_hang_ms.store(2500, Ordering::SeqCst);
    std::thread::scope(|scope| {
        let grabbing = scope.spawn(|| lease.grab(&never_cancelled()).map(|frame| frame.sequence));
        wait_until("hanging", || spy.frame_hang_ms.load(Ordering::SeqCst) == 0);
        let off_after = wait_until("laser off", || bench.control.laser_power() == 0.0);
        assert!(off_after <= Duration::from_secs(1), "off after {off_after:?}");
        let _ = grabbing.join().unwrap();
    });
}

#[test]
fn a_stop_is_carried_out_while_a_camera_on_its_own_thread_hangs() {
    let (devices, spy) = spied_on_its_own_thread(small_devices());
    let bench = bench_of(devices);
    bench.wait_for("ready", |status| status.activity == "ready");
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    let hang = Duration::from_millis(2500);
    spy.frame_hang_ms.store(hang.as_millis() as u64, Ordering::SeqCst);
    let hung_at = Instant::now();
    std::thread::scope(|scope| {
        let grabbing = scope.spawn(|| lease.grab(&never_cancelled()).map(|frame| frame.sequence));
        wait_until("hanging", || spy.frame_hang_ms.load(Ordering::SeqCst) == 0);
        let requested = Instant::now();
        bench.stop();
        assert!(requested.elapsed() <= STOP_LIMIT, "reported after {:?}", requested.elapsed());
        assert_eq!(bench.control.laser_power(), 0.0);
        assert!(matches!(grabbing.join().unwrap(), Err(StationRefusal::Stopped { .. })));
    });
    drop(lease);
    std::thread::sleep((hung_at + hang + STOP_LIMIT).saturating_duration_since(Instant::now()));
    bench.manual(Manual::Reset).unwrap();
    bench.wait_for("ready", |status| status.activity == "ready");
    bench.lease().grab(&never_cancelled()).unwrap();
}

#[test]
fn the_end_of_the_thread_turns_the_laser_off() {
    let devices = small_devices();
    let control = devices.twin.as_ref().unwrap().control().unwrap();
    let station = StationHandle::start_with(devices, Watch::default(), false);
    let purpose =
        crate::Purpose { job_id: "job".to_owned(), activity: "scanning".to_owned(), epoch: station.stop_epoch() };
    let lease = station.lease(purpose).unwrap();
    lease.laser_on(1.0).unwrap();
    assert!(control.laser_power() > 0.0);
    station.shut_down();
    assert_eq!(control.laser_power(), 0.0);
    assert!(matches!(lease.grab(&never_cancelled()), Err(StationRefusal::ShuttingDown)));
}

#[test]
fn a_camera_whose_frames_arrive_incomplete_is_given_more_time_than_a_silent_one_and_reported_as_what_it_is() {
    const RATE_HZ: f64 = 4.0;
    for (incomplete, expected_s, detail, remedy) in [
        (false, 1.5, "no frame arrived within", "check the camera and its trigger"),
        (true, 10.0 / RATE_HZ, "were incomplete", "packet size"),
    ] {
        let (devices, spy) = spied(small_devices());
        let bench = bench_of(devices);
        bench.wait_for("ready", |status| status.activity == "ready");
        let wanted = CameraRequest { frame_rate_hz: Some(RATE_HZ), ..CameraRequest::default() };
        bench.manual(Manual::Configure(wanted)).unwrap();
        wait(bench.station.live(LiveRequest { running: true, laser_power: 0.0 })).unwrap();
        bench.wait_for("frames", |status| status.frames_arrived > 1);
        spy.loses_incomplete.store(incomplete, Ordering::SeqCst);
        spy.loses.store(u64::MAX, Ordering::SeqCst);
        let lost_since = Instant::now();
        bench.wait_for("in error", |status| status.state == MachineState::Error);
        // The last frame came up to a period before.
        assert!(lost_since.elapsed().as_secs_f64() > expected_s - 1.0 / RATE_HZ, "{:?}", lost_since.elapsed());
        let status = bench.station.status();
        let [fault] = &status.faults[..] else { panic!("{:?}", status.faults) };
        assert_eq!((fault.device, fault.kind), ("camera", "silent"));
        assert!(fault.detail.contains(detail) && fault.remedy.contains(remedy), "{fault:?}");
    }
}
