//! Recordings: one MCAP file each, once it is finished.

use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::{Listed, Page};
use crate::error::StoreError;
use crate::records::RecordingRecord;
use crate::sqlite::changes::{Written, inserted, met};
use crate::sqlite::error::reading;
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{before_id, get, json, optional_artifact, size_bytes, word, word_from};
use crate::sqlite::seal;

const KIND: &str = "recording";

fn from_row(row: &SqliteRow) -> Result<RecordingRecord, StoreError> {
    seal::intact(row, &seal::RECORDINGS)?;
    Ok(RecordingRecord {
        id: get(row, "id")?,
        name: get(row, "name")?,
        origin: get(row, "origin")?,
        state: word(row, "state")?,
        scan_id: get(row, "scan_id")?,
        calibration_id: get(row, "calibration_id")?,
        file: optional_artifact(row, "file")?,
        size_bytes: size_bytes(row, "size_bytes")?,
        summary: json(row, "summary")?,
        started_at_ms: get(row, "started_at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<RecordingRecord, StoreError> {
    let row = sqlx::query("SELECT * FROM recordings WHERE id = $1").bind(id).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a recording"))? {
        Some(row) => from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }),
    }
}

pub async fn page(readers: &SqlitePool, page: &Page) -> Result<Listed<RecordingRecord>, StoreError> {
    let rows = sqlx::query("SELECT * FROM recordings WHERE id < $1 ORDER BY id DESC")
        .bind(before_id(page))
        .fetch(readers);
    listed(rows, page.limit, "list recordings", from_row, every, |recording| recording.id.clone()).await
}

pub async fn insert(to: &mut SqliteConnection, recording: &RecordingRecord) -> Written {
    let result = sqlx::query(
        "INSERT INTO recordings
         (id, name, origin, state, scan_id, calibration_id, file, size_bytes, summary, started_at_ms)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10) ON CONFLICT (id) DO NOTHING",
    )
    .bind(&recording.id)
    .bind(&recording.name)
    .bind(&recording.origin)
    .bind(word_from(recording.state))
    .bind(&recording.scan_id)
    .bind(&recording.calibration_id)
    .bind(recording.file.as_ref().map(|file| file.as_str()))
    .bind(recording.size_bytes.cast_signed())
    .bind(recording.summary.to_string())
    .bind(recording.started_at_ms)
    .execute(to)
    .await?;
    inserted(result, KIND, &recording.id)
}

pub async fn update(to: &mut SqliteConnection, recording: &RecordingRecord) -> Written {
    let result =
        sqlx::query("UPDATE recordings SET state = $2, file = $3, size_bytes = $4, summary = $5 WHERE id = $1")
            .bind(&recording.id)
            .bind(word_from(recording.state))
            .bind(recording.file.as_ref().map(|file| file.as_str()))
            .bind(recording.size_bytes.cast_signed())
            .bind(recording.summary.to_string())
            .execute(to)
            .await?;
    met(result, KIND, &recording.id)
}

pub async fn delete(to: &mut SqliteConnection, id: &str) -> Written {
    let result = sqlx::query("DELETE FROM recordings WHERE id = $1").bind(id).execute(to).await?;
    met(result, KIND, id)
}
