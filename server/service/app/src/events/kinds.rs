//! The kinds of events, each with its body.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::artifacts::{
    Activation, CalibrationCreated, CaptureCreated, ModelCreated, RecordingEnded, RecordingStarted, SessionVersion,
};
use super::doors::{DeliveriesChanged, DeliveryDead, DoorWaiting};
use super::initiator::Initiator;
use super::inspections::{InspectionFinished, InspectionsHeld, RecipePublished, RuleViolated};
use super::jobs::JobEvent;
use super::scans::{MeasurementCreated, MeasurementPlanChanged, ScanCreated, ScanExported, WatchWarned};
use super::station::{
    CameraConfigured, CameraDarkFrameTaken, CameraFeaturesSet, ControlTakenOver, LaserSwitched, LiveView,
    SimulatedFault, StageMotion,
};

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
    /// A CAD model was uploaded.
    #[serde(rename = "model.created")]
    ModelCreated(ModelCreated),
    /// A CAD model was deleted.
    #[serde(rename = "model.deleted")]
    ModelDeleted(Initiator),
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
    /// An inspection was the first to violate a run rule of a control chart.
    #[serde(rename = "control_chart.rule_violated")]
    ControlChartRuleViolated(RuleViolated),
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
    /// A study of the station was created.
    #[serde(rename = "study.created")]
    StudyCreated(SessionVersion),
    /// An acceptance test got another position.
    #[serde(rename = "study.changed")]
    StudyChanged(SessionVersion),
    /// A study of the station was deleted.
    #[serde(rename = "study.deleted")]
    StudyDeleted(Initiator),
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
    SimulationFaultOff(Initiator),
}

/// An empty body.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct EmptyBody {}
