//! The health that follows from faults, watches and calibrations, and that a change of them is followed.

#![allow(clippy::unwrap_used)]

use std::sync::Arc;
use std::time::Duration;

use station::{Fault, first_status};
use store::{CalibrationRecord, Change, EventRecord, ExpectedActive, Store};
use tokio::sync::{mpsc, watch};

use super::*;
use crate::evented_catalogue::EventedCatalogue;

/// Longer than a change takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

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

/// A calibration of this id becomes active, as its activation is stored.
async fn activate(store: &Store, catalogue: &EventedCatalogue, id: &str) {
    let record = CalibrationRecord {
        id: id.to_owned(),
        document: store.artifacts.put(id.as_bytes()).await.unwrap(),
        report: None,
        capture_id: None,
        job_id: None,
        summary: serde_json::json!({}),
        created_at_ms: 7,
    };
    let activation = Change::Activate {
        calibration_id: Some(id.to_owned()),
        expected_previous: ExpectedActive::Any,
        act: "activate".to_owned(),
        actor: "test".to_owned(),
        at_ms: 8,
    };
    let activated = Change::AppendEvent(EventRecord {
        seq: 0,
        kind: "calibration.activated".to_owned(),
        subject: id.to_owned(),
        body: serde_json::json!({}),
        at_ms: 8,
    });
    catalogue.commit(vec![Change::InsertCalibration(record), activation, activated]).await.unwrap();
}

#[tokio::test]
async fn followers_hear_of_a_new_calibration_and_of_a_fault_until_the_station_is_shut_down() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).await.unwrap();
    let catalogue = EventedCatalogue::open(store.catalogue.clone()).await.unwrap();
    let status = watch::Sender::new(Arc::new(working()));
    let (sender, mut published) = mpsc::unbounded_channel();
    let following = tokio::spawn({
        let (catalogue, watched) = (catalogue.clone(), status.subscribe());
        async move { follow(&catalogue, watched, |_, health| sender.send(health.clone()).unwrap()).await }
    });
    let mut next = async || tokio::time::timeout(PATIENCE, published.recv()).await.unwrap();

    let before = next().await.unwrap();
    assert_eq!((states(&before)[0], &before.calibration), (MaintenanceRequired, &None));
    activate(&store, &catalogue, "c").await;
    let calibrated = next().await.unwrap();
    assert_eq!(states(&calibrated), [Normal; 4]);
    assert_eq!(calibrated.calibration, Some(CalibrationInUse { id: "c".to_owned(), created_at_ms: 7 }));
    status.send_modify(|status| Arc::make_mut(status).faults.push(fault("stage", "it stalled", 9)));
    assert_eq!(states(&next().await.unwrap()), [Failure, Normal, Failure, Normal]);

    drop(status);
    assert_eq!(next().await, None);
    tokio::time::timeout(PATIENCE, following).await.unwrap().unwrap();
}
