//! Calibrations and the log of activations.

use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::{ExpectedActive, Listed, Page};
use crate::error::StoreError;
use crate::records::{ActivationRecord, CalibrationRecord};
use crate::sqlite::changes::{Written, met, next, refuse_dangling};
use crate::sqlite::error::{is_dangling, reading};
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{artifact, get, json, optional_artifact};
use crate::sqlite::seal;

const KIND: &str = "calibration";

fn from_row(row: &SqliteRow) -> Result<CalibrationRecord, StoreError> {
    seal::intact(row, &seal::CALIBRATIONS)?;
    Ok(CalibrationRecord {
        id: get(row, "id")?,
        document: artifact(row, "document")?,
        report: optional_artifact(row, "report")?,
        capture_id: get(row, "capture_id")?,
        job_id: get(row, "job_id")?,
        summary: json(row, "summary")?,
        created_at_ms: get(row, "created_at_ms")?,
    })
}

fn activation_from_row(row: &SqliteRow) -> Result<ActivationRecord, StoreError> {
    seal::intact(row, &seal::ACTIVATIONS)?;
    Ok(ActivationRecord {
        seq: get(row, "seq")?,
        calibration_id: get(row, "calibration_id")?,
        previous_id: get(row, "previous_id")?,
        act: get(row, "act")?,
        actor: get(row, "actor")?,
        at_ms: get(row, "at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<CalibrationRecord, StoreError> {
    let row = sqlx::query("SELECT * FROM calibrations WHERE id = $1").bind(id).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a calibration"))? {
        Some(row) => from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }),
    }
}

/// Newest first by arrival: the ids are hashes and have no order.
pub async fn page(readers: &SqlitePool, page: &Page) -> Result<Listed<CalibrationRecord>, StoreError> {
    let before = match &page.before {
        None => i64::MAX,
        Some(id) => position(readers, id).await?,
    };
    let rows = sqlx::query("SELECT * FROM calibrations WHERE position < $1 ORDER BY position DESC")
        .bind(before)
        .fetch(readers);
    listed(rows, page.limit, "list calibrations", from_row, every, |calibration| calibration.id.clone()).await
}

async fn position(readers: &SqlitePool, id: &str) -> Result<i64, StoreError> {
    let row = sqlx::query("SELECT * FROM calibrations WHERE id = $1")
        .bind(id)
        .fetch_optional(readers)
        .await
        .map_err(|cause| reading(cause, "list calibrations"))?
        .ok_or_else(|| StoreError::NotFound { kind: KIND, id: id.to_owned() })?;
    seal::intact(&row, &seal::CALIBRATIONS)?;
    get(&row, "position")
}

pub async fn active(readers: &SqlitePool) -> Result<Option<ActivationRecord>, StoreError> {
    let row = sqlx::query("SELECT * FROM activations ORDER BY seq DESC LIMIT 1").fetch_optional(readers).await;
    row.map_err(|cause| reading(cause, "read the active calibration"))?
        .as_ref()
        .map(activation_from_row)
        .transpose()
}

pub async fn activations(readers: &SqlitePool, page: &Page) -> Result<Listed<ActivationRecord>, StoreError> {
    let before = match &page.before {
        None => i64::MAX,
        Some(text) => text.parse().map_err(|_| StoreError::NotFound { kind: "activation", id: text.clone() })?,
    };
    let rows =
        sqlx::query("SELECT * FROM activations WHERE seq < $1 ORDER BY seq DESC").bind(before).fetch(readers);
    listed(rows, page.limit, "list activations", activation_from_row, every, |act| act.seq.to_string()).await
}

/// The same content is stored once.
pub async fn insert(to: &mut SqliteConnection, calibration: &CalibrationRecord) -> Written {
    if exists(to, &calibration.id).await? {
        return Ok(());
    }
    let position = next(to, KIND).await?;
    let result = sqlx::query(
        "INSERT INTO calibrations (id, position, document, report, capture_id, job_id, summary, created_at_ms)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8)",
    )
    .bind(&calibration.id)
    .bind(position)
    .bind(calibration.document.as_str())
    .bind(calibration.report.as_ref().map(|report| report.as_str()))
    .bind(&calibration.capture_id)
    .bind(&calibration.job_id)
    .bind(calibration.summary.to_string())
    .bind(calibration.created_at_ms)
    .execute(to)
    .await;
    refuse_dangling(result, KIND, &calibration.id, "refers to a capture that does not exist")?;
    Ok(())
}

pub async fn delete(to: &mut SqliteConnection, id: &str) -> Written {
    if last_activated(to).await?.as_deref() == Some(id) {
        return Err(refused(id, "is active", "activate another one first").into());
    }
    let result = sqlx::query("DELETE FROM calibrations WHERE id = $1").bind(id).execute(to).await;
    let result = match result {
        Err(cause) if is_dangling(&cause) => {
            return Err(refused(id, "is needed to recompute scans", "delete those first").into());
        }
        result => result?,
    };
    met(result, KIND, id)
}

/// The active calibration; refused if it is not the one the caller expected.
pub async fn previous(to: &mut SqliteConnection, expected: ExpectedActive) -> Written<Option<String>> {
    let previous = last_activated(to).await?;
    match expected {
        ExpectedActive::Is(expected) if expected != previous => {
            let id = previous.or(expected).unwrap_or_default();
            Err(StoreError::Changed { kind: "the active calibration", id }.into())
        }
        _ => Ok(previous),
    }
}

pub async fn activate(to: &mut SqliteConnection, entry: ActivationRecord) -> Written {
    if let Some(id) = &entry.calibration_id
        && !exists(to, id).await?
    {
        return Err(StoreError::NotFound { kind: KIND, id: id.clone() }.into());
    }
    let seq = next(to, "activation").await?;
    sqlx::query(
        "INSERT INTO activations (seq, calibration_id, previous_id, act, actor, at_ms) VALUES ($1, $2, $3, $4, $5, $6)",
    )
    .bind(seq)
    .bind(entry.calibration_id)
    .bind(entry.previous_id)
    .bind(entry.act)
    .bind(entry.actor)
    .bind(entry.at_ms)
    .execute(&mut *to)
    .await?;
    seal::seal(to, &seal::ACTIVATIONS, &seq.to_string()).await?;
    Ok(())
}

async fn exists(to: &mut SqliteConnection, id: &str) -> Written<bool> {
    let row = sqlx::query("SELECT id FROM calibrations WHERE id = $1").bind(id).fetch_optional(to).await?;
    Ok(row.is_some())
}

async fn last_activated(to: &mut SqliteConnection) -> Written<Option<String>> {
    let row = sqlx::query("SELECT * FROM activations ORDER BY seq DESC LIMIT 1").fetch_optional(to).await?;
    Ok(row.as_ref().map(activation_from_row).transpose()?.and_then(|entry| entry.calibration_id))
}

fn refused(id: &str, why: &str, remedy: &'static str) -> StoreError {
    StoreError::Refused { kind: KIND, id: id.to_owned(), why: why.to_owned(), remedy: Some(remedy) }
}
