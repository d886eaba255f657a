//! The health of the station as values of variables.

use std::collections::BTreeMap;

use app::doors::{DeviceIdentity, now_ms};
use app::health::{Health, StationHealth};
use opcua::types::{DataValue, DateTime, LocalizedText, StatusCode, Variant};

use crate::information_model::ids::instances::{CAMERA, LASER, STAGE, SYSTEM};
use crate::line::Condition;
use crate::result::time;

/// The watches, by their variables.
const WATCHES: [(&str, &str, &str); 4] = [
    (STAGE, "LostSteps", "lost_steps"),
    (STAGE, "StageScale", "stage_scale"),
    (LASER, "Wavelength", "wavelength"),
    (LASER, "OrderPowers", "order_powers"),
];

/// What the variables show.
#[derive(Default)]
pub struct ShownHealth {
    shown: BTreeMap<String, (Known, i64)>,
}

/// A value, or why there is none.
type Known = Result<Variant, StatusCode>;

/// A value for a variable, with the time of its cause if that is known.
struct Reading {
    path: String,
    known: Known,
    at_ms: Option<i64>,
}

impl ShownHealth {
    /// What has changed, for variables by their paths. The source timestamp of a value is the time of its cause; if
    /// that is unknown, or before the value that was shown last, it is now: values reach clients in order.
    pub fn changes(&mut self, condition: &Condition) -> Vec<(String, DataValue)> {
        let mut changes = Vec::new();
        for Reading { path, known, at_ms } in readings(condition) {
            let before = self.shown.get(&path);
            let since = before.map_or(i64::MIN, |(_, since)| *since);
            let newer_ms = at_ms.filter(|at_ms| *at_ms > since);
            // Another scan may say the same: then the time alone is new.
            if before.is_some_and(|(shown, _)| *shown == known) && newer_ms.is_none() {
                continue;
            }
            let at_ms = newer_ms.unwrap_or_else(|| now_ms().max(since));
            changes.push((path.clone(), data_value(&known, at_ms)));
            self.shown.insert(path, (known, at_ms));
        }
        changes
    }
}

fn data_value(known: &Known, at_ms: i64) -> DataValue {
    // Without a value, the library leaves out the status, too.
    DataValue {
        value: Some(known.clone().unwrap_or(Variant::Empty)),
        status: Some(known.as_ref().err().copied().unwrap_or(StatusCode::Good)),
        source_timestamp: Some(time(at_ms)),
        server_timestamp: Some(DateTime::now()),
        ..DataValue::null()
    }
}

/// Nothing while the health is not known.
fn readings(condition: &Condition) -> Vec<Reading> {
    let Some(health) = &condition.health else { return Vec::new() };
    let all =
        [(SYSTEM, &health.station), (CAMERA, &health.camera), (STAGE, &health.stage), (LASER, &health.laser)];
    let mut readings: Vec<Reading> =
        all.into_iter().flat_map(|(owner, health)| of_health(owner, health)).collect();
    readings.extend(of_calibration(health));
    readings.extend(WATCHES.map(|(owner, name, watch)| of_watch(health, (owner, name), watch)));
    readings.extend(of_devices(condition));
    readings
}

fn reading(owner: &str, name: &str, known: Known, at_ms: Option<i64>) -> Reading {
    Reading { path: format!("{owner}.{name}"), known, at_ms }
}

fn of_health(owner: &str, health: &Health) -> [Reading; 2] {
    let message = LocalizedText::new("en", &health.message);
    [
        reading(owner, "Health.DeviceHealth", Ok(health.state.number().into()), health.since_ms),
        reading(owner, "Health.Message", Ok(message.into()), health.since_ms),
    ]
}

fn of_calibration(health: &StationHealth) -> [Reading; 2] {
    let calibration = health.calibration.as_ref().ok_or(StatusCode::BadNoData);
    let id = calibration.map(|calibration| calibration.id.as_str().into());
    let at = calibration.map(|calibration| time(calibration.created_at_ms).into());
    [reading(SYSTEM, "Health.CalibrationId", id, None), reading(SYSTEM, "Health.CalibratedAt", at, None)]
}

fn of_watch(health: &StationHealth, (owner, name): (&str, &str), watch: &str) -> Reading {
    let outcome = health.watches.iter().find(|outcome| outcome.watch == watch);
    let state = outcome.map(|outcome| outcome.state.as_str().into()).ok_or(StatusCode::BadNoData);
    reading(owner, &format!("Health.{name}"), state, outcome.map(|outcome| outcome.at_ms))
}

fn of_devices(condition: &Condition) -> Vec<Reading> {
    let devices = &condition.devices;
    let silent = StatusCode::BadNoCommunication;
    // A laser that answers, but not about its interlock, has none that can be read.
    let no_interlock = if devices.laser.is_some() { StatusCode::BadNotSupported } else { silent };
    let mut readings = vec![
        reading(CAMERA, "Health.FramesLost", devices.frames_lost.map(Variant::from).ok_or(silent), None),
        reading(STAGE, "Health.Homed", devices.homed.map(Variant::from).ok_or(silent), None),
        reading(LASER, "Health.Light", devices.light.map(Variant::from).ok_or(silent), None),
        reading(
            LASER,
            "Health.InterlockClosed",
            devices.interlock_closed.map(Variant::from).ok_or(no_interlock),
            None,
        ),
    ];
    for (owner, identity) in [(CAMERA, &devices.camera), (STAGE, &devices.stage), (LASER, &devices.laser)] {
        let property = |name: &str, of: fn(&DeviceIdentity) -> Variant| {
            let known = identity.as_ref().map(of).ok_or(silent);
            reading(owner, &format!("Identification.{name}"), known, None)
        };
        readings.extend([
            property("Manufacturer", |of| LocalizedText::new("", &of.vendor).into()),
            property("Model", |of| LocalizedText::new("", &of.model).into()),
            property("SerialNumber", |of| of.serial.as_str().into()),
            property("SoftwareRevision", |of| of.firmware.as_str().into()),
        ]);
    }
    readings
}
