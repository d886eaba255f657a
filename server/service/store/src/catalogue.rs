//! The catalogue: typed reads and atomic changes.

use std::collections::HashSet;

use async_trait::async_trait;
use serde::{Deserialize, Serialize};

use crate::artifacts::ArtifactId;
use crate::error::StoreError;
use crate::records::{
    ActivationRecord, CalibrationRecord, CaptureRecord, DeliveryRecord, DeliveryState, DoorRecord, EventRecord,
    IdempotencyRecord, InspectionRecord, JobOutcome, JobRecord, JobState, MeasurementRecord, ModelRecord,
    RecipeRecord, RecipeVersionRecord, RecordingRecord, ScanRecord, ScanState, SessionRecord, SettingRecord,
    StudyRecord,
};

/// Which calibration a change expects to be active.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum ExpectedActive {
    /// Any.
    Any,
    /// This one, or none.
    Is(Option<String>),
}

/// One change; a list of them is one transaction. The serialised form is for passing changes between processes of the
/// same version; it is not stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Change {
    /// A job is accepted.
    InsertJob(JobRecord),
    /// A queued job starts.
    StartJob {
        /// Which.
        id: String,
        /// When.
        at_ms: i64,
    },
    /// Progress of a running job.
    CheckpointJob {
        /// Which.
        id: String,
        /// 0–1.
        progress: f64,
        /// Message for the operator.
        message: String,
        /// Checkpoint from which it can be resumed; `None`: unchanged.
        checkpoint: Option<serde_json::Value>,
    },
    /// A job that is not terminal ends.
    EndJob {
        /// Which.
        id: String,
        /// How.
        outcome: JobOutcome,
        /// Final message for the operator.
        message: String,
        /// When.
        at_ms: i64,
    },
    /// A capture is stored.
    InsertCapture(CaptureRecord),
    /// A capture is deleted; its archive is deleted once nothing else refers to it.
    DeleteCapture(String),
    /// A recording starts.
    InsertRecording(RecordingRecord),
    /// A recording is updated: ended, finished, or repaired after a crash.
    UpdateRecording(RecordingRecord),
    /// A recording is deleted; its file is deleted once nothing else refers to it.
    DeleteRecording(String),
    /// A calibration was computed; the same content twice is stored once.
    InsertCalibration(CalibrationRecord),
    /// A calibration is deleted; refused for the active one, and while a scan was computed with it.
    DeleteCalibration(String),
    /// Activates a calibration.
    Activate {
        /// `None`: nothing.
        calibration_id: Option<String>,
        /// Refused with [`StoreError::Changed`] if another one is active by now.
        expected_previous: ExpectedActive,
        /// `activate` or `roll_back`.
        act: String,
        /// By whom.
        actor: String,
        /// When.
        at_ms: i64,
    },
    /// A scan was stored.
    InsertScan(ScanRecord),
    /// A scan is replaced by its resumed version.
    ReplaceScan(ScanRecord),
    /// A scan and its measurements are deleted.
    DeleteScan(String),
    /// A measurement was stored.
    InsertMeasurement(MeasurementRecord),
    /// A CAD model is stored.
    InsertModel(ModelRecord),
    /// A CAD model is deleted; its file is deleted once no recipe refers to it.
    DeleteModel(String),
    /// A version of a recipe is published: the first one creates the recipe; any other is refused with
    /// [`StoreError::Changed`] unless it follows the newest.
    PublishRecipe {
        /// The version.
        version: RecipeVersionRecord,
        /// The number of the recipe from now on; refused if another recipe in use has it.
        number: Option<i64>,
    },
    /// A recipe is archived or restored.
    ArchiveRecipe {
        /// Which.
        id: String,
        /// Whether it is archived.
        archived: bool,
    },
    /// An inspection is stored together with the event that announces it: `seq` of the record, and `seq` in the body of
    /// the event, are the next number of all inspections.
    InsertInspection {
        /// The inspection; its `seq` is ignored.
        inspection: InspectionRecord,
        /// What is announced; its `seq` is that of the event log.
        event: EventRecord,
    },
    /// A session is created.
    InsertSession(SessionRecord),
    /// A session changes; refused with [`StoreError::Changed`] unless its version is `body.version − 1`.
    UpdateSession(SessionRecord),
    /// A session is deleted.
    DeleteSession(String),
    /// A study is created.
    InsertStudy(StudyRecord),
    /// A study changes; refused with [`StoreError::Changed`] unless its version is `body.version − 1`.
    UpdateStudy(StudyRecord),
    /// A study is deleted.
    DeleteStudy(String),
    /// Stores a value under a name; it replaces the previous one.
    PutSetting(SettingRecord),
    /// Appends an event; `seq` is assigned by the store.
    AppendEvent(EventRecord),
    /// Stores how far a door is; it replaces what was stored before.
    PutDoor(DoorRecord),
    /// A door sets an event aside, or tries it again.
    PutDelivery(DeliveryRecord),
    /// A delivery that was set aside is done, or given up by a user.
    DeleteDelivery {
        /// Name of the door.
        door: String,
        /// Number of the event.
        seq: i64,
    },
    /// A request with an idempotency key is stored; refused with [`StoreError::Exists`] if the key exists.
    InsertIdempotency(IdempotencyRecord),
    /// Jobs that have ended are deleted, if they ended before this, or are not among the newest.
    PruneEndedJobs {
        /// Wall clock.
        before_ms: i64,
        /// Number of jobs kept.
        keep_newest: u32,
    },
    /// Stores the response to the request with this key; `None`: it was refused and may be repeated.
    AnswerIdempotency {
        /// Which.
        key: String,
        /// Status, `Location` and body of the response.
        answer: Option<serde_json::Value>,
    },
    /// Keys older than this are deleted.
    PruneIdempotencyKeys {
        /// Wall clock.
        at_ms: i64,
    },
    /// Events up to this one are deleted.
    PruneEventsThrough {
        /// Sequence.
        seq: i64,
    },
}

impl Change {
    /// Whether it frees space or ends a job: then the reserve is released for it on a full disk.
    pub fn makes_room(&self) -> bool {
        matches!(
            self,
            Self::EndJob { .. }
                | Self::DeleteCapture(_)
                | Self::DeleteRecording(_)
                | Self::DeleteCalibration(_)
                | Self::DeleteScan(_)
                | Self::DeleteModel(_)
                | Self::DeleteSession(_)
                | Self::DeleteStudy(_)
                | Self::DeleteDelivery { .. }
                | Self::PruneEndedJobs { .. }
                | Self::PruneIdempotencyKeys { .. }
                | Self::PruneEventsThrough { .. }
        )
    }

    /// Whether artifacts may become unreferenced by it.
    pub fn leaves_artifacts(&self) -> bool {
        matches!(
            self,
            Self::DeleteCapture(_)
                | Self::DeleteRecording(_)
                | Self::DeleteCalibration(_)
                | Self::DeleteScan(_)
                | Self::DeleteModel(_)
                | Self::DeleteSession(_)
                | Self::ReplaceScan(_)
                | Self::UpdateSession(_)
                | Self::PruneEndedJobs { .. }
        )
    }
}

/// A page of a list: newest first, `limit` records older than `before`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// Id of the last record of the previous page; `None`: from the newest.
    pub before: Option<String>,
    /// At most this many.
    pub limit: u32,
}

/// Filter for scans.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ScanFilter {
    /// Only scans in this state.
    pub state: Option<ScanState>,
    /// Only those computed with this calibration.
    pub calibration_id: Option<String>,
    /// Only those whose name contains this text; upper and lower case are the same.
    pub name: Option<String>,
    /// Only those made at or after this.
    pub from_ms: Option<i64>,
    /// Only those made before this.
    pub to_ms: Option<i64>,
}

/// Filter for measurements.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct MeasurementFilter {
    /// Only those on this scan.
    pub scan_id: Option<String>,
    /// Only those requested with this `tool`.
    pub tool: Option<String>,
    /// Only those with one of these verdicts; empty: all.
    pub verdicts: Vec<String>,
}

/// Filter for recipes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecipeFilter {
    /// Only those in use, or only those archived.
    pub archived: Option<bool>,
    /// Only the one with this number.
    pub number: Option<i64>,
}

/// Filter for inspections.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct InspectionFilter {
    /// Only of the part with this serial number.
    pub serial: Option<String>,
    /// Only for this order.
    pub order_number: Option<String>,
    /// Only by this recipe.
    pub recipe_id: Option<String>,
    /// Only by this version of it.
    pub recipe_version: Option<i64>,
    /// Only with this verdict.
    pub verdict: Option<String>,
    /// Only those made at or after this.
    pub from_ms: Option<i64>,
    /// Only those made before this.
    pub to_ms: Option<i64>,
}

/// Filter for deliveries that were set aside.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeliveryFilter {
    /// Name of the door.
    pub door: String,
    /// Only those in this state.
    pub state: Option<DeliveryState>,
    /// Only those whose next attempt is due by then.
    pub due_at_ms: Option<i64>,
}

/// The deliveries that a door has set aside, counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SetAside {
    /// Waiting for another attempt.
    pub n_waiting: i64,
    /// No longer tried.
    pub n_dead: i64,
    /// Time of the next attempt of a waiting one.
    pub next_at_ms: Option<i64>,
}

/// A damaged row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DamagedRow {
    /// Which collection.
    pub kind: &'static str,
    /// Its key as stored.
    pub id: String,
}

/// A page of a list: intact records, and the damaged rows between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Listed<T> {
    /// The intact records, at most `limit`.
    pub records: Vec<T>,
    /// Damaged rows in the range. A filter cannot be applied to them: they are all reported.
    pub damaged: Vec<DamagedRow>,
    /// Start of the next page; `None` on the last one.
    pub next: Option<String>,
}

impl<T> Listed<T> {
    /// The records, for callers that cannot handle gaps.
    ///
    /// # Errors
    /// [`StoreError::DamagedRecord`] for the first row that is damaged.
    pub fn whole(self) -> Result<Vec<T>, StoreError> {
        match self.damaged.into_iter().next() {
            None => Ok(self.records),
            Some(DamagedRow { kind, id }) => Err(StoreError::DamagedRecord { kind, id }),
        }
    }

    /// Maps the records.
    pub fn map<U>(self, change: impl FnMut(T) -> U) -> Listed<U> {
        let Self { records, damaged, next } = self;
        Listed { records: records.into_iter().map(change).collect(), damaged, next }
    }
}

impl From<DamagedRow> for StoreError {
    fn from(row: DamagedRow) -> Self {
        Self::DamagedRecord { kind: row.kind, id: row.id }
    }
}

/// Typed reads and atomic changes. Lists are newest first and report unreadable rows.
#[async_trait]
pub trait Catalogue: Send + Sync {
    /// Applies all `changes` or none; they are durable when it returns. Returns the events as stored.
    async fn commit(&self, changes: Vec<Change>) -> Result<Vec<EventRecord>, StoreError>;

    /// A job.
    async fn job(&self, id: &str) -> Result<JobRecord, StoreError>;
    /// Jobs, of one state if given.
    async fn jobs(&self, state: Option<JobState>, page: &Page) -> Result<Listed<JobRecord>, StoreError>;
    /// Queued jobs, oldest first.
    async fn queue(&self) -> Result<Listed<JobRecord>, StoreError>;

    /// A capture.
    async fn capture(&self, id: &str) -> Result<CaptureRecord, StoreError>;
    /// Captures.
    async fn captures(&self, page: &Page) -> Result<Listed<CaptureRecord>, StoreError>;

    /// A recording.
    async fn recording(&self, id: &str) -> Result<RecordingRecord, StoreError>;
    /// Recordings.
    async fn recordings(&self, page: &Page) -> Result<Listed<RecordingRecord>, StoreError>;

    /// A calibration.
    async fn calibration(&self, id: &str) -> Result<CalibrationRecord, StoreError>;
    /// Calibrations.
    async fn calibrations(&self, page: &Page) -> Result<Listed<CalibrationRecord>, StoreError>;
    /// The last entry of the log of activations; `None` if nothing was ever activated.
    async fn active(&self) -> Result<Option<ActivationRecord>, StoreError>;
    /// The log of activations; `page.before` is a sequence.
    async fn activations(&self, page: &Page) -> Result<Listed<ActivationRecord>, StoreError>;

    /// A scan.
    async fn scan(&self, id: &str) -> Result<ScanRecord, StoreError>;
    /// Scans.
    async fn scans(&self, filter: &ScanFilter, page: &Page) -> Result<Listed<ScanRecord>, StoreError>;
    /// Measurements.
    async fn measurements(
        &self,
        filter: &MeasurementFilter,
        page: &Page,
    ) -> Result<Listed<MeasurementRecord>, StoreError>;
    /// A measurement.
    async fn measurement(&self, id: &str) -> Result<MeasurementRecord, StoreError>;

    /// A CAD model.
    async fn model(&self, id: &str) -> Result<ModelRecord, StoreError>;
    /// CAD models.
    async fn models(&self, page: &Page) -> Result<Listed<ModelRecord>, StoreError>;

    /// A recipe.
    async fn recipe(&self, id: &str) -> Result<RecipeRecord, StoreError>;
    /// Recipes, newest first.
    async fn recipes(&self, filter: &RecipeFilter, page: &Page) -> Result<Listed<RecipeRecord>, StoreError>;
    /// A version of a recipe.
    async fn recipe_version(&self, id: &str, version: i64) -> Result<RecipeVersionRecord, StoreError>;
    /// The versions of a recipe; `page.before` is a version.
    async fn recipe_versions(&self, id: &str, page: &Page) -> Result<Listed<RecipeVersionRecord>, StoreError>;

    /// An inspection.
    async fn inspection(&self, id: &str) -> Result<InspectionRecord, StoreError>;
    /// Inspections.
    async fn inspections(
        &self,
        filter: &InspectionFilter,
        page: &Page,
    ) -> Result<Listed<InspectionRecord>, StoreError>;
    /// At most `limit` inspections after `seq`, oldest first; `next` is a `seq`.
    async fn inspections_after(
        &self,
        filter: &InspectionFilter,
        seq: i64,
        limit: u32,
    ) -> Result<Listed<InspectionRecord>, StoreError>;

    /// A session.
    async fn session(&self, id: &str) -> Result<SessionRecord, StoreError>;
    /// Sessions.
    async fn sessions(&self, page: &Page) -> Result<Listed<SessionRecord>, StoreError>;

    /// A study.
    async fn study(&self, id: &str) -> Result<StudyRecord, StoreError>;
    /// Studies.
    async fn studies(&self, page: &Page) -> Result<Listed<StudyRecord>, StoreError>;

    /// The setting of this name, if any.
    async fn setting(&self, name: &str) -> Result<Option<SettingRecord>, StoreError>;

    /// At most `limit` events after `seq`, oldest first.
    async fn events_after(&self, seq: i64, limit: u32) -> Result<Listed<EventRecord>, StoreError>;
    /// Sequence of the newest event, pruned ones included; 0 if there never was one.
    async fn last_event_seq(&self) -> Result<i64, StoreError>;

    /// How far a door is; `None` if it was never opened.
    async fn door(&self, name: &str) -> Result<Option<DoorRecord>, StoreError>;
    /// A delivery that was set aside.
    async fn delivery(&self, door: &str, seq: i64) -> Result<DeliveryRecord, StoreError>;
    /// At most `limit` deliveries that were set aside, of events after `seq`, oldest first; `next` is a `seq`.
    async fn deliveries(
        &self,
        filter: &DeliveryFilter,
        seq: i64,
        limit: u32,
    ) -> Result<Listed<DeliveryRecord>, StoreError>;
    /// Their numbers.
    async fn set_aside(&self, door: &str) -> Result<SetAside, StoreError>;

    /// The request with this idempotency key, if any.
    async fn idempotency(&self, key: &str) -> Result<Option<IdempotencyRecord>, StoreError>;

    /// All artifacts that any record refers to, also within documents.
    async fn artifacts_named(&self) -> Result<HashSet<ArtifactId>, StoreError>;
}
