//! The records of the catalogue.
//!
//! Times are wall-clock milliseconds since 1970 and serve as labels only; order is given by the records' own ids
//! (UUID v7) and by the sequence of events. Documents that only one part of the service understands (inputs, plans,
//! summaries, problems) are JSON values here.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::artifacts::ArtifactId;

/// State of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// Accepted and waiting.
    Queued,
    /// Running.
    Running,
    /// Done, with a result.
    Succeeded,
    /// Failed with a problem.
    Failed,
    /// Cancelled by a user.
    Cancelled,
    /// The process crashed while it ran.
    Interrupted,
}

impl JobState {
    /// Whether the record is final.
    pub fn is_terminal(self) -> bool {
        !matches!(self, Self::Queued | Self::Running)
    }
}

/// Result of a job: `kind` is the collection (`calibration`, `scan`, …).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResultRef {
    /// What it is.
    pub kind: String,
    /// Its id.
    pub id: String,
}

/// A job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JobRecord {
    /// UUID v7.
    pub id: String,
    /// `calibration`, `scan`, `verification`, `export`, …
    pub kind: String,
    /// Its state.
    pub state: JobState,
    /// The input, as JSON.
    pub input: Value,
    /// Who requested it: `rest`, `station page`, a job id.
    pub source: String,
    /// 0–1, as last stored.
    pub progress: f64,
    /// Message for the operator.
    pub message: String,
    /// The result.
    pub result: Option<ResultRef>,
    /// Why it failed: an RFC 9457 problem.
    pub problem: Option<Value>,
    /// Checkpoint from which an interrupted job can be resumed; its form depends on the kind of job.
    pub checkpoint: Option<Value>,
    /// When it was accepted.
    pub created_at_ms: i64,
    /// When it started.
    pub started_at_ms: Option<i64>,
    /// When it ended.
    pub ended_at_ms: Option<i64>,
}

/// How a job ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum JobOutcome {
    /// With a result.
    Succeeded(ResultRef),
    /// With a problem.
    Failed(Value),
    /// Cancelled by a user.
    Cancelled,
    /// Interrupted by the end of its process.
    Interrupted,
}

/// A capture folder, kept as one archive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CaptureRecord {
    /// UUID v7.
    pub id: String,
    /// Its name.
    pub name: String,
    /// `upload`, `calibration`, `scan`.
    pub origin: String,
    /// The archive.
    pub archive: ArtifactId,
    /// `zip` or `tar`.
    pub archive_format: String,
    /// Bytes of the archive.
    pub size_bytes: u64,
    /// Counts and names from the manifest.
    pub summary: Value,
    /// When it was stored.
    pub created_at_ms: i64,
}

/// A CAD model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelRecord {
    /// UUID v7.
    pub id: String,
    /// Name of its file.
    pub name: String,
    /// The file.
    pub file: ArtifactId,
    /// Bytes of the file.
    pub size_bytes: u64,
    /// Triangles and dimensions.
    pub summary: Value,
    /// When it was stored.
    pub created_at_ms: i64,
}

/// State of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordingState {
    /// Frames are being written.
    Recording,
    /// Ended; the file is being moved into the store.
    Finishing,
    /// Ended properly, for whatever reason.
    Complete,
    /// The process crashed during the recording; the readable part was kept.
    Interrupted,
    /// Nothing in it is readable.
    Failed,
}

/// Frames and stage positions, as one MCAP file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingRecord {
    /// UUID v7.
    pub id: String,
    /// Its name.
    pub name: String,
    /// `live`, `scan`.
    pub origin: String,
    /// Its state.
    pub state: RecordingState,
    /// The recorded scan; it may have been deleted.
    pub scan_id: Option<String>,
    /// The calibration in the file; its record may have been deleted.
    pub calibration_id: Option<String>,
    /// The file, once it is finished.
    pub file: Option<ArtifactId>,
    /// Bytes of the file.
    pub size_bytes: u64,
    /// Frames, losses by reason, and how it ended.
    pub summary: Value,
    /// When it started.
    pub started_at_ms: i64,
}

/// A calibration; a draft until it is activated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRecord {
    /// The document's own id, a hash of its content.
    pub id: String,
    /// The document `sheaf-calibration/1`.
    pub document: ArtifactId,
    /// Residuals, tables and images as an HTML page.
    pub report: Option<ArtifactId>,
    /// The images it was computed from.
    pub capture_id: Option<String>,
    /// The job that created it.
    pub job_id: Option<String>,
    /// Summary for lists.
    pub summary: Value,
    /// When it was created.
    pub created_at_ms: i64,
}

/// An entry of the activation log; the last one is in effect.
#[derive(Debug, Clone, PartialEq)]
pub struct ActivationRecord {
    /// Position in the log.
    pub seq: i64,
    /// The calibration activated by it; `None`: none.
    pub calibration_id: Option<String>,
    /// The previously active calibration.
    pub previous_id: Option<String>,
    /// `activate` or `roll_back`.
    pub act: String,
    /// Who did it.
    pub actor: String,
    /// When.
    pub at_ms: i64,
}

/// State of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScanState {
    /// All planned frames were captured.
    Complete,
    /// Stopped or interrupted; it can be resumed.
    Partial,
    /// Frames were lost: no verdict is possible.
    Invalid,
}

/// A scan: everything needed to compute it again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScanRecord {
    /// UUID v7.
    pub id: String,
    /// Its name; also in the header of the cloud.
    pub name: String,
    /// Its state.
    pub state: ScanState,
    /// Which calibration the cloud was computed with.
    pub calibration_id: String,
    /// How it was made: source, range, step or speed, exposure, mode.
    pub plan: Value,
    /// Peaks of every frame (`sheaf-peaks/2`).
    pub peaks: ArtifactId,
    /// The frames, if they were kept or the scan was computed from a capture.
    pub capture_id: Option<String>,
    /// The cloud as binary PLY; `None` if no point could be computed.
    pub cloud: Option<ArtifactId>,
    /// Display points in the blocks of the live stream.
    pub display: Option<ArtifactId>,
    /// Figures: points, dropped by reason, self-consistency, envelope.
    pub report: Value,
    /// The scan it was recomputed from.
    pub recomputed_from: Option<String>,
    /// The job that created it.
    pub job_id: Option<String>,
    /// Version of the software that computed it.
    pub software_version: String,
    /// When it was created.
    pub created_at_ms: i64,
}

/// A measurement on a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeasurementRecord {
    /// UUID v7.
    pub id: String,
    /// The scan.
    pub scan_id: String,
    /// The request.
    pub request: Value,
    /// Value, uncertainty, verdict.
    pub result: Value,
    /// When.
    pub created_at_ms: i64,
}

/// A recipe: its newest version and the fields it is found by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecipeRecord {
    /// Chosen by the user.
    pub id: String,
    /// The newest of its versions, counted from 1 without gaps.
    pub newest: i64,
    /// Number by which a PLC selects it; unique among recipes that are not archived.
    pub number: Option<i64>,
    /// Archived.
    pub archived: bool,
}

/// A version of a recipe; it never changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecipeVersionRecord {
    /// The recipe.
    pub recipe_id: String,
    /// From 1.
    pub version: i64,
    /// What is scanned, measured and judged.
    pub content: Value,
    /// SHA-256 of the canonical content, hexadecimal.
    pub digest: String,
    /// Who published it.
    pub author: String,
    /// Why.
    pub reason: String,
    /// The version whose content it has again.
    pub restored_from: Option<i64>,
    /// When.
    pub created_at_ms: i64,
}

/// A part that was inspected; it never changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InspectionRecord {
    /// UUID v7.
    pub id: String,
    /// Position among all inspections, from 1 without gaps, assigned by the store.
    pub seq: i64,
    /// Serial number of the part.
    pub serial: String,
    /// The order it was made for.
    pub order_number: Option<String>,
    /// The recipe.
    pub recipe_id: String,
    /// Its version.
    pub recipe_version: i64,
    /// `ok`, `undecided`, `invalid`, `not_ok`.
    pub verdict: String,
    /// The scan; `None` after it was deleted.
    pub scan_id: Option<String>,
    /// The inspection that this one re-evaluates.
    pub re_evaluated_from: Option<String>,
    /// The job that created it.
    pub job_id: Option<String>,
    /// Results, digest, calibration, attributes.
    pub body: Value,
    /// When.
    pub created_at_ms: i64,
}

/// A calibration session: images captured step by step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionRecord {
    /// UUID v7.
    pub id: String,
    /// Grows with every change; the ETag of the resource.
    pub version: i64,
    /// Target, images (each with its artifact and detected features), step.
    pub body: Value,
    /// When it was created.
    pub created_at_ms: i64,
    /// When it was last changed.
    pub changed_at_ms: i64,
}

/// A study of the station: an acceptance test, or a study of its capability as a measuring system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyRecord {
    /// UUID v7.
    pub id: String,
    /// Grows with every change.
    pub version: i64,
    /// Plan, and what was found so far.
    pub body: Value,
    /// When it was created.
    pub created_at_ms: i64,
    /// When it was last changed.
    pub changed_at_ms: i64,
}

/// A setting: a named value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SettingRecord {
    /// A stable name: `station.halted`, `camera.settings`, …
    pub name: String,
    /// The value.
    pub value: Value,
    /// When it was stored.
    pub changed_at_ms: i64,
}

/// An event; readers see a sequence without gaps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EventRecord {
    /// Position in the log, assigned by the store.
    pub seq: i64,
    /// `job.succeeded`, `calibration.activated`, `station.state`, …
    pub kind: String,
    /// Id of the resource concerned.
    pub subject: String,
    /// The body.
    pub body: Value,
    /// When.
    pub at_ms: i64,
}

/// A door: an interface that delivers events to another system.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DoorRecord {
    /// Its configured name.
    pub name: String,
    /// Every event up to this one is delivered, set aside as a [`DeliveryRecord`], or of no interest to the door.
    pub seq: i64,
    /// Number of delivered events.
    pub n_delivered: i64,
    /// The last delivered event.
    pub delivered_seq: Option<i64>,
    /// When it was delivered.
    pub delivered_at_ms: Option<i64>,
}

/// State of a delivery that was set aside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DeliveryState {
    /// It is tried again.
    Waiting,
    /// It is no longer tried: a dead letter, until a user resends or deletes it.
    Dead,
}

/// An event that a door has set aside so that later ones pass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DeliveryRecord {
    /// Name of the door.
    pub door: String,
    /// A copy of the event: the log may be pruned meanwhile.
    pub event: EventRecord,
    /// State.
    pub state: DeliveryState,
    /// Number of failed attempts.
    pub n_attempts: i64,
    /// Time of the next attempt, if waiting.
    pub next_at_ms: i64,
    /// Why the last attempt failed.
    pub reason: String,
}

/// A request with an idempotency key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IdempotencyRecord {
    /// The client's key, with method and path in front.
    pub key: String,
    /// SHA-256 of the request body.
    pub body_sha256: String,
    /// Status, `Location` and body of the response; null until it is known.
    pub answer: Value,
    /// When.
    pub created_at_ms: i64,
}
