//! Health of the station and of its devices, in the terms of NAMUR NE 107 that OPC 10000-100 uses.
//!
//! It follows from the faults of the devices, from the watches of the newest scan and from the active calibration. It
//! is computed here alone, so that every interface shows the same.

mod records;
#[cfg(test)]
mod tests;

pub use records::{CalibrationInUse, HealthRecords, WatchOutcome, follow};

use station::{MachineState, StationStatus};

/// Condition of a device or of the station, with the numbers of `DeviceHealthEnumeration` (OPC 10000-100).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HealthState {
    /// It works.
    #[default]
    Normal = 0,
    /// It does not work.
    Failure = 1,
    /// It is not in use at the moment: it is being connected, or was stopped by a person.
    CheckFunction = 2,
    /// It works outside of its specification: results of the newest scan are invalid.
    OffSpec = 3,
    /// It works; somebody should look after it.
    MaintenanceRequired = 4,
}

impl HealthState {
    /// Its number.
    pub fn number(self) -> i32 {
        self as i32
    }

    /// Which of several applies: the lowest, in the order of NE 107.
    fn precedence(self) -> u8 {
        match self {
            Self::Failure => 0,
            Self::CheckFunction => 1,
            Self::OffSpec => 2,
            Self::MaintenanceRequired => 3,
            Self::Normal => 4,
        }
    }
}

/// Health of a device or of the station.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Health {
    /// Its condition.
    pub state: HealthState,
    /// The reason, and what to do; empty if the condition is normal.
    pub message: String,
    /// When the reason occurred, ms since 1970, if that is known.
    pub since_ms: Option<i64>,
}

/// Health of the station.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StationHealth {
    /// As a whole: the worst of its devices, and what concerns none of them alone.
    pub station: Health,
    /// The camera.
    pub camera: Health,
    /// The stage.
    pub stage: Health,
    /// The laser with its optics.
    pub laser: Health,
    /// The watches of the newest scan with the active calibration; empty before the first one.
    pub watches: Vec<WatchOutcome>,
    /// The active calibration.
    pub calibration: Option<CalibrationInUse>,
}

impl StationHealth {
    /// The health that follows from a status and from stored records.
    pub fn of(status: &StationStatus, records: &HealthRecords) -> Self {
        let device = |name: &str, connected| worst(causes(name, connected, status, records));
        let camera = device("camera", status.camera.connected);
        let stage = device("stage", status.stage.connected);
        let laser = device("laser", status.laser.connected);
        let station = worst([faults(status, |_| true), general(status, records)].concat().into_iter().chain([
            camera.clone(),
            stage.clone(),
            laser.clone(),
        ]));
        let HealthRecords { watches, calibration } = records.clone();
        Self { station, camera, stage, laser, watches, calibration }
    }
}

/// The one that applies; the first of equal ones.
fn worst(causes: impl IntoIterator<Item = Health>) -> Health {
    causes.into_iter().min_by_key(|health| health.state.precedence()).unwrap_or_default()
}

/// What concerns a device, newest faults first.
fn causes(device: &str, connected: bool, status: &StationStatus, records: &HealthRecords) -> Vec<Health> {
    let mut causes = faults(status, |of| of == device);
    if !connected && causes.is_empty() {
        let message = format!("the {device} is being connected");
        causes.push(Health { state: HealthState::CheckFunction, message, since_ms: None });
    }
    let watches = records.watches.iter().filter(|watch| watch.device() == Some(device));
    causes.extend(watches.filter_map(WatchOutcome::health));
    causes
}

/// Faults of the devices that are `wanted`, newest first.
fn faults(status: &StationStatus, wanted: impl Fn(&str) -> bool) -> Vec<Health> {
    let faults = status.faults.iter().rev().filter(|fault| wanted(fault.device));
    let health = |fault: &station::Fault| Health {
        state: HealthState::Failure,
        message: format!("{}; {}", fault.detail, fault.remedy),
        since_ms: Some(fault.since_ms),
    };
    faults.map(health).collect()
}

/// What concerns no device alone.
fn general(status: &StationStatus, records: &HealthRecords) -> Vec<Health> {
    let cause = |state, message: &str| Health { state, message: message.to_owned(), since_ms: None };
    let mut causes = Vec::new();
    if status.state == MachineState::Halted {
        causes.push(cause(HealthState::CheckFunction, "the station is stopped; reset it"));
    }
    if records.calibration.is_none() {
        let message = "no calibration is active; calibrate the station, or activate a calibration";
        causes.push(cause(HealthState::MaintenanceRequired, message));
    }
    causes
}
