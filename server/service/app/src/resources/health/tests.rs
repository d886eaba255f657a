//! The health that follows from faults, watches and calibrations, and that a change of them is followed.

#![allow(clippy::unwrap_used)]

use station::{Fault, first_status};

use super::*;

fn working() -> StationStatus {
    let mut status = first_status(None, MachineState::Preoperational);
    status.camera.connected = true;
    status.stage.connected = true;
    status.laser.connected = true;
    status
}

fn fault(device: &'static str, detail: &str, since_ms: i64) -> Fault {
    Fault { device, kind: "alarm", detail: detail.to_owned(), remedy: "look after it".to_owned(), since_ms }
}

fn records(watch: &str, state: &str) -> HealthRecords {
    let calibration = Some(CalibrationInUse { id: "c".to_owned(), created_at_ms: 7 });
    let outcome =
        WatchOutcome { watch: watch.to_owned(), state: state.to_owned(), reason: "why".to_owned(), at_ms: 9 };
    HealthRecords { watches: vec![outcome], calibration }
}

fn states(health: &StationHealth) -> [HealthState; 4] {
    [&health.station, &health.camera, &health.stage, &health.laser].map(|health| health.state)
}

use HealthState::{CheckFunction, Failure, MaintenanceRequired, Normal, OffSpec};

#[test]
fn a_station_without_faults_whose_watches_are_quiet_is_normal() {
    for state in ["quiet", "blind"] {
        let health = StationHealth::of(&working(), &records("lost_steps", state));
        assert_eq!(states(&health), [Normal; 4], "{state}");
        assert_eq!(health.station, Health::default());
    }
}

#[test]
fn a_watch_concerns_its_device_and_the_station() {
    let stage = |state| [state, Normal, state, Normal];
    let laser = |state| [state, Normal, Normal, state];
    for (watch, state, expected) in [
        ("lost_steps", "invalid", stage(OffSpec)),
        ("stage_scale", "warning", stage(MaintenanceRequired)),
        ("wavelength", "invalid", laser(OffSpec)),
        ("order_powers", "warning", laser(MaintenanceRequired)),
    ] {
        let health = StationHealth::of(&working(), &records(watch, state));
        assert_eq!(states(&health), expected, "{watch} {state}");
        assert_eq!((health.station.message.as_str(), health.station.since_ms), ("why", Some(9)));
    }
}

#[test]
fn a_fault_outweighs_a_watch_and_the_newest_of_a_device_is_stated() {
    let mut status = working();
    status.faults = vec![fault("stage", "it stalled", 1), fault("stage", "it is disconnected", 2)];
    let health = StationHealth::of(&status, &records("lost_steps", "invalid"));
    assert_eq!(states(&health), [Failure, Normal, Failure, Normal]);
    assert_eq!(health.stage.message, "it is disconnected; look after it");
    assert_eq!((health.stage.since_ms, &health.station), (Some(2), &health.stage));
}

#[test]
fn a_device_without_a_fault_that_is_not_connected_yet_is_being_connected() {
    let mut status = working();
    status.camera.connected = false;
    let health = StationHealth::of(&status, &records("lost_steps", "quiet"));
    assert_eq!(states(&health), [CheckFunction, CheckFunction, Normal, Normal]);
}

#[test]
fn a_stopped_station_and_one_without_a_calibration_say_so() {
    let mut status = working();
    let health = StationHealth::of(&status, &HealthRecords::default());
    assert_eq!(states(&health), [MaintenanceRequired, Normal, Normal, Normal]);
    status.state = MachineState::Halted;
    let health = StationHealth::of(&status, &HealthRecords::default());
    assert_eq!(states(&health), [CheckFunction, Normal, Normal, Normal]);
    assert_eq!(health.station.message, "the station is stopped; reset it");
}
