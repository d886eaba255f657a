//! Stop is final: afterwards nothing moves or emits light, whether it was authorised before or is requested later.

use std::time::{Duration, Instant};

use super::bench::{bench, bench_with, never_cancelled, small_devices, wait};
use crate::station_thread::handle::Watch;
use crate::{Fault, LiveRequest, MachineState, Manual, OperationalState, StationRefusal};

#[test]
fn work_authorised_before_a_stop_is_refused_even_after_the_reset() {
    let bench = bench();
    let before = bench.station.stop_epoch();
    bench.stop();
    assert!(matches!(bench.lease_of(before).map(drop), Err(StationRefusal::Stopped { .. })));
    assert!(matches!(bench.try_lease().map(drop), Err(StationRefusal::Halted)));
    bench.manual(Manual::Reset).unwrap();
    assert!(matches!(bench.lease_of(before).map(drop), Err(StationRefusal::Stopped { .. })));
    assert!(bench.lease().grab(&never_cancelled()).is_ok());
}

#[test]
fn a_station_that_was_stopped_before_the_program_began_is_halted_until_a_reset() {
    let bench = bench_with(small_devices(), Watch::default(), true);
    assert_eq!(bench.station.status().state, MachineState::Halted);
    assert!(bench.station.is_halted());
    assert!(matches!(bench.try_lease().map(drop), Err(StationRefusal::Halted)));
    assert!(matches!(bench.manual(Manual::Home), Err(StationRefusal::Halted)));
    let live = LiveRequest { running: true, laser_power: 1.0 };
    assert!(matches!(wait(bench.station.live(live)), Err(StationRefusal::Halted)));
    bench.manual(Manual::Reset).unwrap();
    assert!(!bench.station.is_halted());
    bench.wait_for("ready", |status| status.state == MachineState::Operational(OperationalState::Ready));
}

#[test]
fn a_reset_during_a_job_ends_it_with_the_laser_off_and_at_rest() {
    let bench = bench();
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    std::thread::scope(|scope| {
        let moving = scope.spawn(|| lease.move_to(90.0, Some(5.0), &never_cancelled()));
        bench.wait_for("moving", |status| status.moving);
        bench.manual(Manual::Reset).unwrap();
        assert!(matches!(moving.join().unwrap(), Err(StationRefusal::Stopped { .. })));
    });
    assert_eq!(bench.control.laser_power(), 0.0);
    bench.wait_for("at rest", |status| !status.moving && status.job_id.is_none());
    assert!(matches!(lease.laser_on(1.0), Err(StationRefusal::Stopped { .. })));
}

#[test]
fn an_alarm_from_outside_ends_light_and_motion_and_waits_for_a_person() {
    let bench = bench();
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    let alarm = Fault {
        device: "store",
        kind: "read_only",
        detail: "the data directory is read-only".to_owned(),
        remedy: "check the disk".to_owned(),
        since_ms: 0,
    };
    std::thread::scope(|scope| {
        let moving = scope.spawn(|| lease.move_to(90.0, Some(5.0), &never_cancelled()));
        bench.wait_for("moving", |status| status.moving);
        bench.station.alarm(alarm);
        assert!(matches!(moving.join().unwrap(), Err(StationRefusal::InError { .. })));
    });
    assert_eq!(bench.control.laser_power(), 0.0);
    bench.wait_for("at rest", |status| status.state == MachineState::Error && !status.moving);
    assert!(matches!(bench.try_lease().map(drop), Err(StationRefusal::InError { .. })));
}

/// After each Stop: old and new jobs, people and the live view; none of them moves or lights anything before a reset.
#[test]
fn after_a_stop_every_motion_and_light_request_is_refused() {
    let bench = bench();
    for round in 0..40_u32 {
        let before = bench.station.stop_epoch();
        let lease = (round % 2 == 0).then(|| bench.lease());
        if let Some(lease) = &lease {
            lease.laser_on(1.0).unwrap();
        } else {
            wait(bench.station.live(LiveRequest { running: true, laser_power: 1.0 })).unwrap();
        }
        bench.stop();
        let rest_mm = bench.control.true_position_mm();
        let until = Instant::now() + Duration::from_millis(30);
        while Instant::now() < until {
            assert!(bench.lease_of(before).is_err() && bench.try_lease().is_err());
            assert!(bench.manual(Manual::Jog { velocity_mm_s: 20.0 }).is_err());
            assert!(wait(bench.station.live(LiveRequest { running: true, laser_power: 1.0 })).is_err());
            if let Some(lease) = &lease {
                assert!(lease.laser_on(1.0).is_err() && lease.grab(&never_cancelled()).is_err());
            }
            assert_eq!(bench.control.laser_power(), 0.0, "round {round}");
            assert_eq!(bench.control.true_position_mm(), rest_mm, "round {round}");
        }
        bench.manual(Manual::Reset).unwrap();
    }
}
