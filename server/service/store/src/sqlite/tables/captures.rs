//! Captures: one archive each.

use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::{Listed, Page};
use crate::error::StoreError;
use crate::records::CaptureRecord;
use crate::sqlite::changes::{Written, inserted, met};
use crate::sqlite::error::reading;
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{artifact, before_id, get, json, size_bytes};
use crate::sqlite::seal;

const KIND: &str = "capture";

fn from_row(row: &SqliteRow) -> Result<CaptureRecord, StoreError> {
    seal::intact(row, &seal::CAPTURES)?;
    Ok(CaptureRecord {
        id: get(row, "id")?,
        name: get(row, "name")?,
        origin: get(row, "origin")?,
        archive: artifact(row, "archive")?,
        archive_format: get(row, "archive_format")?,
        size_bytes: size_bytes(row, "size_bytes")?,
        summary: json(row, "summary")?,
        created_at_ms: get(row, "created_at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<CaptureRecord, StoreError> {
    let row = sqlx::query("SELECT * FROM captures WHERE id = $1").bind(id).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a capture"))? {
        Some(row) => from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }),
    }
}

pub async fn page(readers: &SqlitePool, page: &Page) -> Result<Listed<CaptureRecord>, StoreError> {
    let rows =
        sqlx::query("SELECT * FROM captures WHERE id < $1 ORDER BY id DESC").bind(before_id(page)).fetch(readers);
    listed(rows, page.limit, "list captures", from_row, every, |capture| capture.id.clone()).await
}

pub async fn insert(to: &mut SqliteConnection, capture: &CaptureRecord) -> Written {
    let result = sqlx::query(
        "INSERT INTO captures (id, name, origin, archive, archive_format, size_bytes, summary, created_at_ms)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8) ON CONFLICT (id) DO NOTHING",
    )
    .bind(&capture.id)
    .bind(&capture.name)
    .bind(&capture.origin)
    .bind(capture.archive.as_str())
    .bind(&capture.archive_format)
    .bind(capture.size_bytes.cast_signed())
    .bind(capture.summary.to_string())
    .bind(capture.created_at_ms)
    .execute(to)
    .await?;
    inserted(result, KIND, &capture.id)
}

pub async fn delete(to: &mut SqliteConnection, id: &str) -> Written {
    let result = sqlx::query("DELETE FROM captures WHERE id = $1").bind(id).execute(to).await?;
    met(result, KIND, id)
}
