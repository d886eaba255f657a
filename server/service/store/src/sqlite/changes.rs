//! Applies a list of changes as one transaction.

use std::collections::HashSet;

use sqlx::SqliteConnection;
use sqlx::sqlite::SqliteQueryResult;

use crate::artifacts::ArtifactId;
use crate::catalogue::Change;
use crate::error::StoreError;
use crate::health::Health;
use crate::records::{ActivationRecord, EventRecord};
use crate::sqlite::seal::{self, Table};
use crate::sqlite::tables::{
    calibrations, captures, doors, events, inspections, jobs, measurements, models, recipes, recordings, scans,
    sessions, settings, studies,
};
use crate::sqlite::{error, named};

/// Result of a writing statement; errors are interpreted in one place, at the end.
pub type Written<T = ()> = Result<T, WriteError>;

/// Why a change was refused.
#[derive(Debug)]
pub enum WriteError {
    /// A rule of the catalogue forbids it.
    Rule(StoreError),
    /// The database reported an error.
    Database(sqlx::Error),
}

impl From<sqlx::Error> for WriteError {
    fn from(cause: sqlx::Error) -> Self {
        Self::Database(cause)
    }
}

impl From<StoreError> for WriteError {
    fn from(error: StoreError) -> Self {
        Self::Rule(error)
    }
}

/// Result of a transaction.
pub struct Committed {
    /// Events as they were stored.
    pub events: Vec<EventRecord>,
    /// Artifacts that a record newly refers to.
    pub named: Vec<ArtifactId>,
}

/// A row that a change writes, to be sealed afterwards.
struct Touched {
    table: Table,
    key: String,
    /// Artifacts that it referred to before; `None`: unchanged.
    named_before: Option<HashSet<ArtifactId>>,
}

/// Applies all changes or none; they are durable when it returns.
pub async fn apply_all(
    connection: &mut SqliteConnection,
    changes: Vec<Change>,
    health: &Health,
) -> Result<Committed, StoreError> {
    let outcome = transaction(connection, changes).await;
    outcome.map_err(|error| match error {
        WriteError::Rule(error) => error,
        WriteError::Database(cause) => error::writing(cause, "write to the catalogue", health),
    })
}

/// Without sqlx's transaction type: SQLite rolls back automatically when the disk is full; then there is nothing to roll
/// back, and a wrapper that counts transactions would keep counting it.
async fn transaction(connection: &mut SqliteConnection, changes: Vec<Change>) -> Written<Committed> {
    sqlx::raw_sql("BEGIN IMMEDIATE").execute(&mut *connection).await?;
    let written = write(connection, changes).await;
    if written.is_err() {
        let _ = sqlx::raw_sql("ROLLBACK").execute(connection).await;
    }
    written
}

async fn write(connection: &mut SqliteConnection, changes: Vec<Change>) -> Written<Committed> {
    let mut committed = Committed { events: Vec::new(), named: Vec::new() };
    for change in changes {
        let touched = touched_by(connection, &change).await?;
        committed.events.extend(apply(connection, change).await?);
        for Touched { table, key, named_before } in touched {
            let row = seal::seal(connection, &table, &key).await?;
            if let Some((before, row)) = named_before.zip(row) {
                committed.named.extend(named::in_row(&row).into_iter().filter(|id| !before.contains(id)));
            }
        }
    }
    sqlx::raw_sql("COMMIT").execute(connection).await?;
    Ok(committed)
}

/// The rows that a change writes, to be sealed afterwards: either intact now or absent. Events and activations, whose keys
/// are assigned when they are written, are sealed where they are inserted.
async fn touched_by(to: &mut SqliteConnection, change: &Change) -> Written<Vec<Touched>> {
    let (table, key) = match change {
        Change::InsertJob(job) => (seal::JOBS, &job.id),
        Change::StartJob { id, .. } | Change::CheckpointJob { id, .. } | Change::EndJob { id, .. } => {
            (seal::JOBS, id)
        }
        Change::InsertCapture(capture) => (seal::CAPTURES, &capture.id),
        Change::InsertRecording(recording) | Change::UpdateRecording(recording) => {
            (seal::RECORDINGS, &recording.id)
        }
        Change::InsertCalibration(calibration) => (seal::CALIBRATIONS, &calibration.id),
        Change::InsertScan(scan) | Change::ReplaceScan(scan) => (seal::SCANS, &scan.id),
        Change::InsertMeasurement(measurement) => (seal::MEASUREMENTS, &measurement.id),
        Change::InsertModel(model) => (seal::MODELS, &model.id),
        Change::ArchiveRecipe { id, .. } => (seal::RECIPES, id),
        Change::PublishRecipe { version, .. } => {
            seal::verify(to, &seal::RECIPES, &version.recipe_id).await?;
            let key = recipes::key_of(&version.recipe_id, version.version);
            // A new version, which may name models.
            let named = Touched { table: seal::RECIPE_VERSIONS, key, named_before: Some(HashSet::new()) };
            return Ok(still_naming(vec![(seal::RECIPES, version.recipe_id.clone())])
                .into_iter()
                .chain([named])
                .collect());
        }
        Change::InsertInspection { inspection, .. } => (seal::INSPECTIONS, &inspection.id),
        Change::InsertSession(session) | Change::UpdateSession(session) => (seal::SESSIONS, &session.id),
        Change::InsertStudy(study) | Change::UpdateStudy(study) => (seal::STUDIES, &study.id),
        Change::PutSetting(setting) => (seal::SETTINGS, &setting.name),
        Change::PutDoor(door) => (seal::DOORS, &door.name),
        Change::PutDelivery(delivery) => {
            let key = doors::key(&delivery.door, delivery.event.seq);
            seal::verify(to, &seal::DELIVERIES, &key).await?;
            return Ok(still_naming(vec![(seal::DELIVERIES, key)]));
        }
        Change::InsertIdempotency(record) => (seal::IDEMPOTENCY, &record.key),
        Change::AnswerIdempotency { key, .. } => (seal::IDEMPOTENCY, key),
        Change::DeleteCapture(id) => {
            let mut naming = seal::naming(to, &seal::SCANS, "capture_id", id).await?;
            naming.extend(seal::naming(to, &seal::CALIBRATIONS, "capture_id", id).await?);
            return Ok(still_naming(naming));
        }
        Change::DeleteScan(id) => {
            let mut naming = seal::naming(to, &seal::SCANS, "recomputed_from", id).await?;
            naming.extend(seal::naming(to, &seal::INSPECTIONS, "scan_id", id).await?);
            return Ok(still_naming(naming));
        }
        Change::DeleteCalibration(_)
        | Change::DeleteModel(_)
        | Change::DeleteRecording(_)
        | Change::DeleteSession(_)
        | Change::DeleteStudy(_)
        | Change::DeleteDelivery { .. }
        | Change::Activate { .. }
        | Change::AppendEvent(_)
        | Change::PruneEndedJobs { .. }
        | Change::PruneIdempotencyKeys { .. }
        | Change::PruneEventsThrough { .. } => return Ok(Vec::new()),
    };
    let row = seal::verify(to, &table, key).await?;
    let named_before = named::is_named_by(&table).then(|| row.as_ref().map(named::in_row).unwrap_or_default());
    Ok(vec![Touched { table, key: key.clone(), named_before }])
}

/// Rows that refer to the same artifacts as before, or none.
fn still_naming(rows: Vec<(Table, String)>) -> Vec<Touched> {
    rows.into_iter().map(|(table, key)| Touched { table, key, named_before: None }).collect()
}

async fn apply(to: &mut SqliteConnection, change: Change) -> Written<Option<EventRecord>> {
    match change {
        Change::InsertJob(job) => jobs::insert(to, &job).await?,
        Change::StartJob { id, at_ms } => jobs::start(to, &id, at_ms).await?,
        Change::CheckpointJob { id, progress, message, checkpoint } => {
            jobs::checkpoint(to, &id, progress, &message, checkpoint.as_ref()).await?;
        }
        Change::EndJob { id, outcome, message, at_ms } => jobs::end(to, &id, &outcome, &message, at_ms).await?,
        Change::InsertCapture(capture) => captures::insert(to, &capture).await?,
        Change::DeleteCapture(id) => captures::delete(to, &id).await?,
        Change::InsertRecording(recording) => recordings::insert(to, &recording).await?,
        Change::UpdateRecording(recording) => recordings::update(to, &recording).await?,
        Change::DeleteRecording(id) => recordings::delete(to, &id).await?,
        Change::InsertCalibration(calibration) => calibrations::insert(to, &calibration).await?,
        Change::DeleteCalibration(id) => calibrations::delete(to, &id).await?,
        Change::Activate { calibration_id, expected_previous, act, actor, at_ms } => {
            let previous_id = calibrations::previous(to, expected_previous).await?;
            let entry = ActivationRecord { seq: 0, calibration_id, previous_id, act, actor, at_ms };
            calibrations::activate(to, entry).await?;
        }
        Change::InsertScan(scan) => scans::insert(to, &scan).await?,
        Change::ReplaceScan(scan) => scans::replace(to, &scan).await?,
        Change::DeleteScan(id) => scans::delete(to, &id).await?,
        Change::InsertMeasurement(measurement) => measurements::insert(to, &measurement).await?,
        Change::InsertModel(model) => models::insert(to, &model).await?,
        Change::DeleteModel(id) => models::delete(to, &id).await?,
        Change::PublishRecipe { version, number } => recipes::publish(to, &version, number).await?,
        Change::ArchiveRecipe { id, archived } => recipes::archive(to, &id, archived).await?,
        Change::InsertInspection { inspection, event } => {
            return inspections::insert(to, inspection, event).await.map(Some);
        }
        Change::InsertSession(session) => sessions::insert(to, &session).await?,
        Change::UpdateSession(session) => sessions::update(to, &session).await?,
        Change::DeleteSession(id) => sessions::delete(to, &id).await?,
        Change::InsertStudy(study) => studies::insert(to, &study).await?,
        Change::UpdateStudy(study) => studies::update(to, &study).await?,
        Change::DeleteStudy(id) => studies::delete(to, &id).await?,
        Change::PutSetting(setting) => settings::put(to, &setting).await?,
        Change::AppendEvent(event) => return events::append(to, event).await.map(Some),
        Change::PruneEndedJobs { before_ms, keep_newest } => jobs::prune_ended(to, before_ms, keep_newest).await?,
        Change::PutDoor(door) => doors::put(to, &door).await?,
        Change::PutDelivery(delivery) => doors::put_delivery(to, &delivery).await?,
        Change::DeleteDelivery { door, seq } => doors::delete_delivery(to, &doors::key(&door, seq)).await?,
        Change::InsertIdempotency(record) => events::insert_idempotency(to, &record).await?,
        Change::AnswerIdempotency { key, answer } => events::answer_idempotency(to, &key, answer.as_ref()).await?,
        Change::PruneIdempotencyKeys { at_ms } => events::prune_idempotency(to, at_ms).await?,
        Change::PruneEventsThrough { seq } => events::prune_through(to, seq).await?,
    }
    Ok(None)
}

/// The next number of a counter; a rollback also resets the counter, so there are no gaps.
pub async fn next(to: &mut SqliteConnection, sequence: &'static str) -> Written<i64> {
    seal::verify(to, &seal::SEQUENCES, sequence).await?;
    let value = sqlx::query_scalar(
        "INSERT INTO sequences (name, value) VALUES ($1, 1)
         ON CONFLICT (name) DO UPDATE SET value = sequences.value + 1 RETURNING value",
    )
    .bind(sequence)
    .fetch_one(&mut *to)
    .await?;
    seal::seal(to, &seal::SEQUENCES, sequence).await?;
    Ok(value)
}

/// An `INSERT … ON CONFLICT DO NOTHING` must have added a row.
pub fn inserted(result: SqliteQueryResult, kind: &'static str, id: &str) -> Written {
    match result.rows_affected() {
        0 => Err(StoreError::Exists { kind, id: id.to_owned() }.into()),
        _ => Ok(()),
    }
}

/// A statement about one row must have affected it.
pub fn met(result: SqliteQueryResult, kind: &'static str, id: &str) -> Written {
    match result.rows_affected() {
        0 => Err(StoreError::NotFound { kind, id: id.to_owned() }.into()),
        _ => Ok(()),
    }
}

/// A reference to a row that does not exist is refused; the database is not damaged.
pub fn refuse_dangling<T>(result: Result<T, sqlx::Error>, kind: &'static str, id: &str, why: &str) -> Written<T> {
    result.map_err(|cause| match error::is_dangling(&cause) {
        true => StoreError::Refused { kind, id: id.to_owned(), why: why.to_owned(), remedy: None }.into(),
        false => cause.into(),
    })
}
