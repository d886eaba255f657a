//! The records of the catalogue.
//!
//! Times are wall-clock milliseconds since 1970 and serve as labels only; order is given by the records' own ids
//! (UUID v7) and by the sequence of events. Documents that only one part of the service understands (inputs, plans,
//! summaries, problems) are JSON values here.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::artifacts::ArtifactId;

/// Where a job is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// Accepted and waiting.
    Queued,
    /// At work.
    Running,
    /// Done, with a result.
    Succeeded,
    /// Ended with a problem.
    Failed,
    /// Ended by a person.
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

/// What a job made: `kind` is the collection (`calibration`, `scan`, …).
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
    /// Where it is in its life.
    pub state: JobState,
    /// What was asked for: the job's own input.
    pub input: Value,
    /// Who asked: `rest`, `station page`, a job's id.
    pub source: String,
    /// 0–1, as last stored.
    pub progress: f64,
    /// In the operator's words.
    pub message: String,
    /// What it made.
    pub result: Option<ResultRef>,
    /// Why it failed: an RFC 9457 problem.
    pub problem: Option<Value>,
    /// From where an interrupted job can go on; the job's own business.
    pub checkpoint: Option<Value>,
    /// When it was accepted.
    pub created_at_ms: i64,
    /// When it began.
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
    /// By a person.
    Cancelled,
    /// With its process.
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
    /// When it came.
    pub created_at_ms: i64,
}

/// Where a recording is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordingState {
    /// Frames are added.
    Recording,
    /// It has ended and is made a file of the store.
    Finishing,
    /// It ended as it should, whatever ended it.
    Complete,
    /// The process died while it ran; what could be read is there.
    Interrupted,
    /// Nothing of it can be read.
    Failed,
}

/// What camera and stage delivered, as one MCAP file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingRecord {
    /// UUID v7.
    pub id: String,
    /// Its name.
    pub name: String,
    /// `live`, `scan`.
    pub origin: String,
    /// Where it is in its life.
    pub state: RecordingState,
    /// The scan it is of, there or not.
    pub scan_id: Option<String>,
    /// The calibration in it, there or not.
    pub calibration_id: Option<String>,
    /// The file, once it is finished.
    pub file: Option<ArtifactId>,
    /// Bytes of the file.
    pub size_bytes: u64,
    /// Frames, losses by reason, and how it ended.
    pub summary: Value,
    /// When it began.
    pub started_at_ms: i64,
}

/// A calibration; a draft until it is activated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRecord {
    /// The document's own id, a hash of its content.
    pub id: String,
    /// The document `sheaf-calibration/1`.
    pub document: ArtifactId,
    /// Residuals, tables and pictures as an HTML page.
    pub report: Option<ArtifactId>,
    /// The pictures it was made from.
    pub capture_id: Option<String>,
    /// The job that made it.
    pub job_id: Option<String>,
    /// Summary for lists.
    pub summary: Value,
    /// When it was made.
    pub created_at_ms: i64,
}

/// An entry of the log of activations; the last one says what is active.
#[derive(Debug, Clone, PartialEq)]
pub struct ActivationRecord {
    /// Position in the log.
    pub seq: i64,
    /// What is active from here on; `None`: nothing.
    pub calibration_id: Option<String>,
    /// What was before.
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
    /// Every planned frame is in it.
    Complete,
    /// It was stopped or interrupted; it can be resumed.
    Partial,
    /// Frames were lost: no verdict possible.
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
    /// The plan it was made by: range, step or speed, exposure, mode.
    pub plan: Value,
    /// Peaks of every frame (`sheaf-peaks/2`).
    pub peaks: ArtifactId,
    /// The frames, if they were asked for or the scan was made from a capture.
    pub capture_id: Option<String>,
    /// The cloud as binary PLY; `None` if no point could be computed.
    pub cloud: Option<ArtifactId>,
    /// Display points in the blocks of the live stream.
    pub display: Option<ArtifactId>,
    /// Figures: points, dropped by reason, self-consistency, envelope.
    pub report: Value,
    /// The scan it was recomputed from.
    pub recomputed_from: Option<String>,
    /// The job that made it.
    pub job_id: Option<String>,
    /// Version of the software that computed it.
    pub software_version: String,
    /// When it was made.
    pub created_at_ms: i64,
}

/// A measurement on a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeasurementRecord {
    /// UUID v7.
    pub id: String,
    /// The scan.
    pub scan_id: String,
    /// What was asked.
    pub request: Value,
    /// Value, uncertainty, verdict.
    pub result: Value,
    /// When.
    pub created_at_ms: i64,
}

/// A recipe: its newest version and what finds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecipeRecord {
    /// Given by people.
    pub id: String,
    /// The newest of its versions, counted from 1 without gaps.
    pub newest: i64,
    /// By which a PLC calls it; no two recipes that are not archived have the same.
    pub number: Option<i64>,
    /// No longer used.
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
    /// Position among all inspections, from 1 without gaps, given by the store.
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
    /// The scan; `None` once it was deleted.
    pub scan_id: Option<String>,
    /// The inspection whose scan was judged anew.
    pub re_evaluated_from: Option<String>,
    /// The job that made it.
    pub job_id: Option<String>,
    /// Results, digest, calibration, attributes.
    pub body: Value,
    /// When.
    pub created_at_ms: i64,
}

/// A calibration in the making: pictures taken step by step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionRecord {
    /// UUID v7.
    pub id: String,
    /// Grows with every change; the ETag of the resource.
    pub version: i64,
    /// Target, pictures (each with its artifact and what was found in it), step.
    pub body: Value,
    /// When it was begun.
    pub created_at_ms: i64,
    /// When it was changed last.
    pub changed_at_ms: i64,
}

/// A setting: a named value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SettingRecord {
    /// A stable name: `station.halted`, `camera.settings`, …
    pub name: String,
    /// The value.
    pub value: Value,
    /// When it was put there.
    pub changed_at_ms: i64,
}

/// An event; readers see a sequence without gaps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EventRecord {
    /// Position in the log, given by the store.
    pub seq: i64,
    /// `job.succeeded`, `calibration.activated`, `station.state`, …
    pub kind: String,
    /// The id it is about.
    pub subject: String,
    /// What the reader gets.
    pub body: Value,
    /// When.
    pub at_ms: i64,
}

/// A request with an idempotency key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IdempotencyRecord {
    /// The client's key, with method and path in front.
    pub key: String,
    /// SHA-256 of the body it came with.
    pub body_sha256: String,
    /// Status, `Location` and body of the answer; null while it is not known.
    pub answer: Value,
    /// When.
    pub created_at_ms: i64,
}
