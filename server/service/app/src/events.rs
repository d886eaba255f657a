//! Events as stored and published: one kind per action, each with its own body.
//!
//! `openapi/events.md` lists them; it is generated from the types below.

use devices::StageKind;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use station::wall_clock::now_ms;
use store::{CaptureRecord, Change, EventRecord};
use utoipa::ToSchema;

use crate::camera::memory::StoredCameraSettings;
use crate::error::AppError;

/// An event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", content = "body")]
pub enum Event {
    /// A job was accepted.
    #[serde(rename = "job.queued")]
    JobQueued(JobEvent),
    /// A job started.
    #[serde(rename = "job.running")]
    JobRunning(JobEvent),
    /// A job succeeded.
    #[serde(rename = "job.succeeded")]
    JobSucceeded(JobEvent),
    /// A job failed.
    #[serde(rename = "job.failed")]
    JobFailed(JobEvent),
    /// A job was cancelled by a user.
    #[serde(rename = "job.cancelled")]
    JobCancelled(JobEvent),
    /// A job was interrupted by the end of the service.
    #[serde(rename = "job.interrupted")]
    JobInterrupted(JobEvent),
    /// A capture was uploaded or recorded.
    #[serde(rename = "capture.created")]
    CaptureCreated(CaptureCreated),
    /// A capture was deleted.
    #[serde(rename = "capture.deleted")]
    CaptureDeleted(Initiator),
    /// A recording was started.
    #[serde(rename = "recording.started")]
    RecordingStarted(RecordingStarted),
    /// A recording ended.
    #[serde(rename = "recording.ended")]
    RecordingEnded(RecordingEnded),
    /// A recording was deleted.
    #[serde(rename = "recording.deleted")]
    RecordingDeleted(Initiator),
    /// A calibration was computed.
    #[serde(rename = "calibration.created")]
    CalibrationCreated(CalibrationCreated),
    /// A calibration was activated.
    #[serde(rename = "calibration.activated")]
    CalibrationActivated(Activation),
    /// An activation was rolled back.
    #[serde(rename = "calibration.rolled_back")]
    CalibrationRolledBack(Activation),
    /// A scan was completed or stored as partial.
    #[serde(rename = "scan.created")]
    ScanCreated(ScanCreated),
    /// A watch raised a warning during or after a scan.
    #[serde(rename = "watch.warned")]
    WatchWarned(WatchWarned),
    /// A scan was exported.
    #[serde(rename = "scan.exported")]
    ScanExported(ScanExported),
    /// A scan was deleted with its measurements.
    #[serde(rename = "scan.deleted")]
    ScanDeleted(Initiator),
    /// A characteristic was measured.
    #[serde(rename = "measurement.created")]
    MeasurementCreated(MeasurementCreated),
    /// The measurement plan was changed.
    #[serde(rename = "measurement_plan.changed")]
    MeasurementPlanChanged(MeasurementPlanChanged),
    /// A version of a recipe was published, imported, or restored from an earlier one.
    #[serde(rename = "recipe.published")]
    RecipePublished(RecipePublished),
    /// A recipe was archived.
    #[serde(rename = "recipe.archived")]
    RecipeArchived(Initiator),
    /// An archived recipe was restored.
    #[serde(rename = "recipe.restored")]
    RecipeRestored(Initiator),
    /// A part was inspected; the event is stored together with the inspection.
    #[serde(rename = "inspection.finished")]
    InspectionFinished(InspectionFinished),
    /// The inspection queue was held: no further inspection starts.
    #[serde(rename = "inspections.held")]
    InspectionsHeld(InspectionsHeld),
    /// The inspection queue was resumed.
    #[serde(rename = "inspections.resumed")]
    InspectionsResumed(Initiator),
    /// A calibration session was created.
    #[serde(rename = "session.created")]
    SessionCreated(SessionVersion),
    /// A calibration session was changed.
    #[serde(rename = "session.changed")]
    SessionChanged(SessionVersion),
    /// A calibration session was deleted.
    #[serde(rename = "session.deleted")]
    SessionDeleted(Initiator),
    /// Control of the station was taken.
    #[serde(rename = "control.taken")]
    ControlTaken(Initiator),
    /// Control was taken over from another holder.
    #[serde(rename = "control.taken_over")]
    ControlTakenOver(ControlTakenOver),
    /// Control was released.
    #[serde(rename = "control.released")]
    ControlReleased(Initiator),
    /// Control expired.
    #[serde(rename = "control.expired")]
    ControlExpired(Initiator),
    /// The station was stopped.
    #[serde(rename = "station.stopped")]
    StationStopped(Initiator),
    /// The station was reset.
    #[serde(rename = "station.reset")]
    StationReset(Initiator),
    /// The live view was started.
    #[serde(rename = "live.started")]
    LiveStarted(LiveView),
    /// The live view was ended.
    #[serde(rename = "live.ended")]
    LiveEnded(LiveView),
    /// Homing of the stage was started.
    #[serde(rename = "stage.homed")]
    StageHomed(StageMotion),
    /// The stage was jogged.
    #[serde(rename = "stage.jogged")]
    StageJogged(StageMotion),
    /// A move of the stage was started.
    #[serde(rename = "stage.moved")]
    StageMoved(StageMotion),
    /// The laser power was set manually.
    #[serde(rename = "laser.switched")]
    LaserSwitched(LaserSwitched),
    /// Camera settings were changed by a user.
    #[serde(rename = "camera.configured")]
    CameraConfigured(CameraConfigured),
    /// Camera features were set by name.
    #[serde(rename = "camera.features_set")]
    CameraFeaturesSet(CameraFeaturesSet),
    /// The camera's dark frame was taken.
    #[serde(rename = "camera.dark_frame_taken")]
    CameraDarkFrameTaken(CameraDarkFrameTaken),
    /// The camera's dark frame was removed.
    #[serde(rename = "camera.dark_frame_removed")]
    CameraDarkFrameRemoved(Initiator),
    /// A door could not deliver an event twice in a row and waits.
    #[serde(rename = "door.waiting")]
    DoorWaiting(DoorWaiting),
    /// A door that waited delivers again.
    #[serde(rename = "door.recovered")]
    DoorRecovered(EmptyBody),
    /// A door gave up the delivery of an event: it is a dead letter now.
    #[serde(rename = "delivery.dead")]
    DeliveryDead(DeliveryDead),
    /// Deliveries were scheduled again by a user.
    #[serde(rename = "delivery.resent")]
    DeliveryResent(DeliveriesChanged),
    /// A dead letter was deleted by a user.
    #[serde(rename = "delivery.deleted")]
    DeliveryDeleted(DeliveriesChanged),
    /// A simulated fault was activated.
    #[serde(rename = "simulation.fault_enabled")]
    SimulationFaultOn(SimulatedFault),
    /// A simulated fault was deactivated.
    #[serde(rename = "simulation.fault_disabled")]
    SimulationFaultOff(EmptyBody),
}

/// An empty body.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct EmptyBody {}

/// A job in an event.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct JobEvent {
    /// Id of the job.
    pub id: String,
    /// `calibration`, `scan`, `recomputation`, `verification`, `export`, `inspection`, `re_evaluation`.
    pub kind: String,
    /// `queued`, `running`, `succeeded`, `failed`, `cancelled`, `interrupted`.
    pub state: String,
    /// Who requested it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Final message for the operator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// The result.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub result: Option<JobResult>,
    /// Why the job failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<AppError>,
    /// Who cancelled it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub actor: Option<String>,
}

/// Result of a job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct JobResult {
    /// Kind of resource.
    pub kind: String,
    /// Its id.
    pub id: String,
}

/// A capture that was uploaded or recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CaptureCreated {
    /// Its name.
    pub name: String,
    /// `upload`, `calibration`, `scan`.
    pub origin: String,
}

impl From<&CaptureRecord> for CaptureCreated {
    fn from(record: &CaptureRecord) -> Self {
        Self { name: record.name.clone(), origin: record.origin.clone() }
    }
}

/// A recording that was started.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingStarted {
    /// Its name.
    pub name: String,
    /// The recorded scan; absent for a live view.
    pub scan_id: Option<String>,
    /// Who started it; absent if a job did.
    pub actor: Option<String>,
}

/// A recording that has ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingEnded {
    /// Its name.
    pub name: String,
    /// `complete`, `interrupted`, `failed`.
    pub state: String,
    /// `stopped`, `live_ended`, `scan_ended`, `scan_began`, `disk_floor`, `disk_full`, `write_failed`, `service_ended`,
    /// `crashed`.
    pub ended: String,
    /// Recorded frames.
    pub n_frames: u64,
    /// Missing exposures.
    pub n_lost: u64,
    /// Size of the file.
    pub size_bytes: u64,
}

/// A calibration that was computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CalibrationCreated {
    /// The job that computed it.
    pub job_id: String,
    /// Model of the light sheets; absent without laser images.
    pub model: Option<String>,
    /// RMS reprojection error of the board corners.
    pub corner_rms_px: f64,
    /// Systematic depth uncertainty over the working volume, 1 σ.
    pub systematic_sigma_mm: Option<f64>,
}

/// A change of the active calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Activation {
    /// The active calibration; absent: none.
    pub calibration_id: Option<String>,
    /// The previously active calibration.
    pub previous_id: Option<String>,
    /// Who did it.
    pub actor: String,
    /// Verdict of its latest verification, if any.
    pub verification: Option<String>,
}

/// A scan that was stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ScanCreated {
    /// Its name.
    pub name: String,
    /// `complete`, `partial`, `invalid`.
    pub state: String,
    /// Number of points; absent without a cloud.
    pub n_points: Option<u64>,
}

/// A warning of a watch; the subject is the scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WatchWarned {
    /// `lost_steps`, `wavelength`, `order_powers`, `stage_scale`.
    pub watch: String,
    /// `warning`, or `invalid`: the error exceeds the stated uncertainty of the points.
    pub state: String,
    /// Measured deviation: mm for lost steps, else relative (natural logarithm for powers).
    pub value: Option<f64>,
    /// Standard deviation of the value.
    pub sigma: Option<f64>,
    /// Stage position at which it starts.
    pub position_mm: Option<f64>,
    /// The warning as a code, as in `WatchReasonDto`; absent in events of version 0.1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason_code: Option<String>,
    /// The warning in a sentence.
    pub reason: String,
}

/// An exported file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ScanExported {
    /// The scan.
    pub scan_id: String,
    /// `cloud` or `mesh`.
    pub what: String,
    /// File format.
    pub format: String,
}

/// A characteristic that was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeasurementCreated {
    /// Id of the scan.
    pub scan_id: String,
    /// The tool.
    pub tool: String,
    /// Its name.
    pub name: Option<String>,
    /// The value, in `unit`; absent if not measurable.
    pub value: Option<f64>,
    /// `mm` or `°`.
    pub unit: String,
    /// Expanded uncertainty (k = 2), in `unit`.
    pub expanded_uncertainty: Option<f64>,
    /// `ok`, `not_ok`, `undecided` or `invalid`; absent without a tolerance.
    pub verdict: Option<String>,
    /// Who requested it; absent if measured in a job.
    pub actor: Option<String>,
}

/// A new version of the measurement plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeasurementPlanChanged {
    /// Version after the change.
    pub version: u64,
    /// Who did it.
    pub actor: String,
}

/// A new version of a recipe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecipePublished {
    /// The version.
    pub version: i64,
    /// SHA-256 of its canonical content, hexadecimal.
    pub digest: String,
    /// Number by which a PLC selects it.
    pub number: Option<u32>,
    /// Why it was published.
    pub reason: String,
    /// The earlier version that it restores.
    pub restored_from: Option<i64>,
    /// Who did it.
    pub actor: String,
}

/// A part that was inspected.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct InspectionFinished {
    /// Position among all inspections, from 1 without gaps.
    pub seq: i64,
    /// Serial number of the part.
    pub serial: String,
    /// The order it was made for.
    pub order: Option<String>,
    /// Recipe and version: `bracket@7`.
    pub recipe: String,
    /// The recipe's number, if it has one.
    pub recipe_number: Option<u32>,
    /// Digest of the recipe's version.
    pub recipe_digest: String,
    /// `ok`, `not_ok`, `undecided` or `invalid`.
    pub verdict: String,
    /// The scan.
    pub scan_id: Option<String>,
    /// The calibration of its cloud.
    pub calibration_id: String,
    /// Whether the devices were simulated, or a recording.
    pub simulated: bool,
    /// The inspection that this one re-evaluates.
    pub re_evaluated_from: Option<String>,
}

/// A hold of the inspection queue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct InspectionsHeld {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Why.
    pub reason: Option<String>,
}

/// A new version of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SessionVersion {
    /// Who did it.
    pub actor: String,
    /// Version after the change.
    pub version: i64,
}

/// Who initiated an action, and from where.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Initiator {
    /// Kind of principal: `local`, a user of this station.
    pub principal: String,
    /// Name: the holder of the control lease, else the name in the request.
    pub actor: String,
    /// Network address.
    pub source: String,
}

/// A takeover of control.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ControlTakenOver {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Previous holder.
    pub from: String,
    /// New holder.
    pub to: String,
}

/// The live view.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LiveView {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Fraction of full laser power, 0 to 1.
    pub laser_power: f64,
}

/// A manual motion of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageMotion {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Target position of a linear stage, if the motion has one.
    pub target_mm: Option<f64>,
    /// Target angle of a rotary stage, if the motion has one.
    pub target_deg: Option<f64>,
    /// Speed of a linear stage.
    pub speed_mm_s: Option<f64>,
    /// Speed of a rotary stage.
    pub speed_deg_s: Option<f64>,
}

/// A value in the unit of the stage as two fields: millimetres of a linear stage, degrees of a rotary one.
pub fn by_kind<T>(kind: StageKind, value: Option<T>) -> (Option<T>, Option<T>) {
    match kind {
        StageKind::Linear => (value, None),
        StageKind::Rotary => (None, value),
    }
}

/// A manual change of the laser power.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LaserSwitched {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Fraction of full power, 0 to 1.
    pub power: f64,
}

/// The camera settings after a change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraConfigured {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// The accepted settings.
    pub settings: StoredCameraSettings,
}

/// A dark frame of the camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraDarkFrameTaken {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Hot pixels.
    pub n_hot_pixels: usize,
}

/// Camera features set by name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraFeaturesSet {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// The features, in the order of the request.
    pub features: Vec<FeatureSet>,
}

/// A feature as read back from the camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FeatureSet {
    /// Its name.
    pub name: String,
    /// Value as text; absent for commands and unreadable features.
    pub value: Option<String>,
}

/// A door that waits; the subject is its name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DoorWaiting {
    /// `folder`, `webhook`, `mqtt`, `modbus`, `opcua`.
    pub kind: String,
    /// Where it delivers to.
    pub target: String,
    /// Why the last attempt failed.
    pub reason: String,
}

/// A delivery that was given up; the subject is the name of the door.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DeliveryDead {
    /// Number of the event.
    pub seq: i64,
    /// Its kind.
    pub kind: String,
    /// Number of failed attempts.
    pub n_attempts: i64,
    /// Why the last attempt failed.
    pub reason: String,
}

/// Deliveries changed by a user; the subject is the name of the door.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DeliveriesChanged {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Numbers of the events.
    pub seqs: Vec<i64>,
}

/// A fault of the simulated station.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SimulatedFault {
    /// Magnitude, if the fault has one.
    pub value: Option<f64>,
}

/// An event about `subject` with the current time, to be appended.
pub fn event(subject: &str, event: Event) -> Change {
    Change::AppendEvent(event_record(subject, event))
}

/// An event about `subject` with the current time.
pub fn event_record(subject: &str, event: Event) -> EventRecord {
    let Ok(Value::Object(mut parts)) = serde_json::to_value(event) else {
        unreachable!("an event is a kind and a body of texts and numbers")
    };
    let kind = parts.remove("kind").and_then(|kind| kind.as_str().map(str::to_owned)).unwrap_or_default();
    let body = parts.remove("body").unwrap_or_default();
    EventRecord { seq: 0, kind, subject: subject.to_owned(), body, at_ms: now_ms() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_stored_by_kind_and_body() {
        let [principal, actor, source] = ["local", "Anna", "127.0.0.1"].map(str::to_owned);
        let initiator = Initiator { principal, actor, source };
        let Change::AppendEvent(record) =
            event("laser", Event::LaserSwitched(LaserSwitched { initiator, power: 0.5 }))
        else {
            panic!("an event is appended")
        };
        assert_eq!((record.kind.as_str(), record.subject.as_str()), ("laser.switched", "laser"));
        let body =
            serde_json::json!({ "principal": "local", "actor": "Anna", "source": "127.0.0.1", "power": 0.5 });
        assert_eq!(record.body, body);
        let Change::AppendEvent(gone) = event("7", Event::SimulationFaultOff(EmptyBody {})) else {
            panic!("appended")
        };
        assert_eq!((gone.kind.as_str(), gone.body), ("simulation.fault_disabled", serde_json::json!({})));
    }
}
