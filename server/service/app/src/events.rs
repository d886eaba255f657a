//! What happens, as it is stored and published: one kind of event for one kind of act, each with its own body.
//!
//! `openapi/events.md` lists them; it is written from the types below.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use station::wall_clock::now_ms;
use store::{CaptureRecord, Change, EventRecord};
use utoipa::ToSchema;

use crate::camera::memory::KeptSettings;
use crate::error::AppError;

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", content = "body")]
pub enum Event {
    /// A job was accepted.
    #[serde(rename = "job.queued")]
    JobQueued(JobEvent),
    /// A job began.
    #[serde(rename = "job.running")]
    JobRunning(JobEvent),
    /// A job ended with a result.
    #[serde(rename = "job.succeeded")]
    JobSucceeded(JobEvent),
    /// A job ended with a problem.
    #[serde(rename = "job.failed")]
    JobFailed(JobEvent),
    /// A job was ended by a person.
    #[serde(rename = "job.cancelled")]
    JobCancelled(JobEvent),
    /// A job ended because the service ended.
    #[serde(rename = "job.interrupted")]
    JobInterrupted(JobEvent),
    /// Pictures were uploaded or recorded.
    #[serde(rename = "capture.created")]
    CaptureCreated(CaptureCreated),
    /// A capture was deleted.
    #[serde(rename = "capture.deleted")]
    CaptureDeleted(Act),
    /// A recording of what the camera delivers began.
    #[serde(rename = "recording.started")]
    RecordingStarted(RecordingStarted),
    /// A recording has ended, whatever ended it.
    #[serde(rename = "recording.ended")]
    RecordingEnded(RecordingEnded),
    /// A recording was deleted.
    #[serde(rename = "recording.deleted")]
    RecordingDeleted(Act),
    /// A calibration was computed.
    #[serde(rename = "calibration.created")]
    CalibrationCreated(CalibrationCreated),
    /// Another calibration is active.
    #[serde(rename = "calibration.activated")]
    CalibrationActivated(Activation),
    /// The calibration before is active again.
    #[serde(rename = "calibration.rolled_back")]
    CalibrationRolledBack(Activation),
    /// A scan was made, in whole or in part.
    #[serde(rename = "scan.created")]
    ScanCreated(ScanCreated),
    /// A watch over the station warns: during a scan, or of one that was made.
    #[serde(rename = "watch.warned")]
    WatchWarned(WatchWarned),
    /// A scan was written in another format.
    #[serde(rename = "scan.exported")]
    ScanExported(ScanExported),
    /// A scan was deleted with its measurements.
    #[serde(rename = "scan.deleted")]
    ScanDeleted(Act),
    /// A characteristic was measured.
    #[serde(rename = "measurement.created")]
    MeasurementCreated(MeasurementCreated),
    /// What Start scans and measures was changed.
    #[serde(rename = "measurement_plan.changed")]
    MeasurementPlanChanged(PlanChanged),
    /// A calibration session was begun.
    #[serde(rename = "session.created")]
    SessionCreated(SessionVersion),
    /// A calibration session was changed.
    #[serde(rename = "session.changed")]
    SessionChanged(SessionVersion),
    /// A calibration session was deleted.
    #[serde(rename = "session.deleted")]
    SessionDeleted(Act),
    /// Somebody took control of the station.
    #[serde(rename = "control.taken")]
    ControlTaken(Act),
    /// Somebody took control from somebody else.
    #[serde(rename = "control.taken_over")]
    ControlTakenOver(TakenOver),
    /// Somebody gave control back.
    #[serde(rename = "control.given_back")]
    ControlGivenBack(Act),
    /// Control lapsed.
    #[serde(rename = "control.expired")]
    ControlExpired(Act),
    /// The station was stopped.
    #[serde(rename = "station.stopped")]
    StationStopped(Act),
    /// The station was reset.
    #[serde(rename = "station.reset")]
    StationReset(Act),
    /// The live view was started.
    #[serde(rename = "live.started")]
    LiveStarted(LiveView),
    /// The live view was ended.
    #[serde(rename = "live.ended")]
    LiveEnded(LiveView),
    /// The stage was sent to its zero.
    #[serde(rename = "stage.homed")]
    StageHomed(Motion),
    /// The stage was moved by hand, for as long as a key was held.
    #[serde(rename = "stage.jogged")]
    StageJogged(Motion),
    /// The stage was sent to a position.
    #[serde(rename = "stage.moved")]
    StageMoved(Motion),
    /// The laser was switched by hand.
    #[serde(rename = "laser.switched")]
    LaserSwitched(LaserSwitched),
    /// The camera was set by a person.
    #[serde(rename = "camera.configured")]
    CameraConfigured(CameraConfigured),
    /// Features of the camera were set by their names.
    #[serde(rename = "camera.features_set")]
    CameraFeaturesSet(CameraFeaturesSet),
    /// A fault of the simulated station was switched on.
    #[serde(rename = "simulation.fault_on")]
    SimulationFaultOn(SimulatedFault),
    /// A fault of the simulated station was switched off.
    #[serde(rename = "simulation.fault_off")]
    SimulationFaultOff(NoBody),
}

/// Nothing more is to be said.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NoBody {}

/// A job, as far as the event knows it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct JobEvent {
    /// The job.
    pub id: String,
    /// `calibration`, `scan`, `recomputation`, `verification`, `export`.
    pub kind: String,
    /// `queued`, `running`, `succeeded`, `failed`, `cancelled`, `interrupted`.
    pub state: String,
    /// Who asked for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Last words to the operator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// The result.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub result: Option<JobResult>,
    /// Why the job failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<AppError>,
    /// Who ended it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub actor: Option<String>,
}

/// Result of a job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct JobResult {
    /// Which collection.
    pub kind: String,
    /// Which one of it.
    pub id: String,
}

/// Pictures that were uploaded or recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CaptureCreated {
    /// What people call them.
    pub name: String,
    /// `upload`, `calibration`, `scan`.
    pub origin: String,
}

impl From<&CaptureRecord> for CaptureCreated {
    fn from(record: &CaptureRecord) -> Self {
        Self { name: record.name.clone(), origin: record.origin.clone() }
    }
}

/// A recording that began.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingStarted {
    /// What people call it.
    pub name: String,
    /// The scan that is recorded; missing for a live view.
    pub scan_id: Option<String>,
    /// Who asked; missing where a job did.
    pub actor: Option<String>,
}

/// A recording that has ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingEnded {
    /// What people call it.
    pub name: String,
    /// `complete`, `interrupted`, `failed`.
    pub state: String,
    /// `stopped`, `live_ended`, `scan_ended`, `scan_began`, `disk_floor`, `disk_full`, `write_failed`, `service_ended`,
    /// `crashed`.
    pub ended: String,
    /// Frames in it.
    pub n_frames: u64,
    /// Exposures that are not in it.
    pub n_lost: u64,
    /// Bytes of its file.
    pub size_bytes: u64,
}

/// A calibration that was computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CalibrationCreated {
    /// By which job.
    pub job_id: String,
    /// Model of its light sheets; missing without laser pictures.
    pub model: Option<String>,
    /// RMS distance of board corners from where the camera expects them.
    pub corner_rms_px: f64,
    /// What it leaves of depth uncertainty over the working volume.
    pub systematic_sigma_mm: Option<f64>,
}

/// Which calibration is active, and which was.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Activation {
    /// The one that is active now; missing: none.
    pub calibration_id: Option<String>,
    /// The one that was.
    pub previous_id: Option<String>,
    /// Who.
    pub actor: String,
    /// The verdict of the newest verification with it, if there was one.
    pub verification: Option<String>,
}

/// A scan that was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ScanCreated {
    /// What people call it.
    pub name: String,
    /// `complete`, `partial`, `invalid`.
    pub state: String,
    /// Points of its cloud; missing where it has none.
    pub n_points: Option<u64>,
}

/// A watch that warns; the subject is the scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WatchWarned {
    /// `lost_steps`, `wavelength`, `order_powers`, `stage_scale`.
    pub watch: String,
    /// `warning`, or `invalid`: the error exceeds the uncertainty that the points state.
    pub state: String,
    /// Its figure: mm for lost steps, else relative (a logarithm for powers).
    pub value: Option<f64>,
    /// One σ of it.
    pub sigma: Option<f64>,
    /// The stage position where it begins.
    pub position_mm: Option<f64>,
    /// In words.
    pub reason: String,
}

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ScanExported {
    /// The scan.
    pub scan_id: String,
    /// `cloud` or `mesh`.
    pub what: String,
    /// The format.
    pub format: String,
}

/// A characteristic that was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeasurementCreated {
    /// On which scan.
    pub scan_id: String,
    /// By which tool.
    pub tool: String,
    /// What people call it.
    pub name: Option<String>,
    /// The value, in `unit`; missing where it is not measurable.
    pub value: Option<f64>,
    /// `mm` or `°`.
    pub unit: String,
    /// Expanded uncertainty (k = 2), in `unit`.
    pub expanded_uncertainty: Option<f64>,
    /// `ok`, `not_ok`, `undecided`, `invalid`; missing without limits.
    pub verdict: Option<String>,
    /// Who asked; missing where it was measured in a job.
    pub actor: Option<String>,
}

/// What Start scans and measures, in its new version.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanChanged {
    /// How often it was changed.
    pub version: u64,
    /// Who.
    pub actor: String,
}

/// A session, in its new version.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SessionVersion {
    /// Who.
    pub actor: String,
    /// How often it was changed.
    pub version: i64,
}

/// Who did it, and from where.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Act {
    /// What kind of principal: `local`, somebody at this station.
    pub principal: String,
    /// Who: the holder of the control lease, else the name that came along.
    pub actor: String,
    /// From which address.
    pub source: String,
}

/// Control that changed hands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TakenOver {
    /// Who and from where.
    #[serde(flatten)]
    pub act: Act,
    /// From whom.
    pub from: String,
    /// To whom.
    pub to: String,
}

/// The live view.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LiveView {
    /// Who and from where.
    #[serde(flatten)]
    pub act: Act,
    /// Share of full laser power, 0 to 1.
    pub laser_power: f64,
}

/// A motion by hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Motion {
    /// Who and from where.
    #[serde(flatten)]
    pub act: Act,
    /// Where to, mm; missing where the command has no target.
    pub target_mm: Option<f64>,
    /// How fast, mm/s.
    pub speed_mm_s: Option<f64>,
}

/// The laser, switched by hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LaserSwitched {
    /// Who and from where.
    #[serde(flatten)]
    pub act: Act,
    /// Share of full power, 0 to 1.
    pub power: f64,
}

/// The camera, as it is set now.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraConfigured {
    /// Who and from where.
    #[serde(flatten)]
    pub act: Act,
    /// What it accepted.
    pub settings: KeptSettings,
}

/// Features of the camera, set by their names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraFeaturesSet {
    /// Who and from where.
    #[serde(flatten)]
    pub act: Act,
    /// In their order.
    pub features: Vec<FeatureSet>,
}

/// A feature as the camera says it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FeatureSet {
    /// Its name.
    pub name: String,
    /// Its value as text; missing for what it does, and what cannot be read.
    pub value: Option<String>,
}

/// A fault of the simulated station.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SimulatedFault {
    /// How strong, where the fault has a strength.
    pub value: Option<f64>,
}

/// An event of now about `subject`, to be appended.
pub fn event(subject: &str, event: Event) -> Change {
    let Ok(Value::Object(mut parts)) = serde_json::to_value(event) else {
        unreachable!("an event is a kind and a body of texts and numbers")
    };
    let kind = parts.remove("kind").and_then(|kind| kind.as_str().map(str::to_owned)).unwrap_or_default();
    let body = parts.remove("body").unwrap_or_default();
    Change::AppendEvent(EventRecord { seq: 0, kind, subject: subject.to_owned(), body, at_ms: now_ms() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_stored_by_kind_and_body() {
        let [principal, actor, source] = ["local", "Anna", "127.0.0.1"].map(str::to_owned);
        let act = Act { principal, actor, source };
        let Change::AppendEvent(record) = event("laser", Event::LaserSwitched(LaserSwitched { act, power: 0.5 }))
        else {
            panic!("an event is appended")
        };
        assert_eq!((record.kind.as_str(), record.subject.as_str()), ("laser.switched", "laser"));
        let body =
            serde_json::json!({ "principal": "local", "actor": "Anna", "source": "127.0.0.1", "power": 0.5 });
        assert_eq!(record.body, body);
        let Change::AppendEvent(gone) = event("7", Event::SimulationFaultOff(NoBody {})) else {
            panic!("appended")
        };
        assert_eq!((gone.kind.as_str(), gone.body), ("simulation.fault_off", serde_json::json!({})));
    }
}
