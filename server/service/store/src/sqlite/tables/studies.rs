//! Studies of the station, changed with optimistic concurrency: each change names the version it follows.

use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::{Listed, Page};
use crate::error::StoreError;
use crate::records::StudyRecord;
use crate::sqlite::changes::{Written, inserted, met};
use crate::sqlite::error::reading;
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{before_id, get, json};
use crate::sqlite::seal;

const KIND: &str = "study";

fn from_row(row: &SqliteRow) -> Result<StudyRecord, StoreError> {
    seal::intact(row, &seal::STUDIES)?;
    Ok(StudyRecord {
        id: get(row, "id")?,
        version: get(row, "version")?,
        body: json(row, "body")?,
        created_at_ms: get(row, "created_at_ms")?,
        changed_at_ms: get(row, "changed_at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<StudyRecord, StoreError> {
    let row = sqlx::query("SELECT * FROM studies WHERE id = $1").bind(id).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a study"))? {
        Some(row) => from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }),
    }
}

pub async fn page(readers: &SqlitePool, page: &Page) -> Result<Listed<StudyRecord>, StoreError> {
    let rows =
        sqlx::query("SELECT * FROM studies WHERE id < $1 ORDER BY id DESC").bind(before_id(page)).fetch(readers);
    listed(rows, page.limit, "list studies", from_row, every, |study| study.id.clone()).await
}

pub async fn insert(to: &mut SqliteConnection, study: &StudyRecord) -> Written {
    let result = sqlx::query(
        "INSERT INTO studies (id, version, body, created_at_ms, changed_at_ms)
         VALUES ($1, $2, $3, $4, $5) ON CONFLICT (id) DO NOTHING",
    )
    .bind(&study.id)
    .bind(study.version)
    .bind(study.body.to_string())
    .bind(study.created_at_ms)
    .bind(study.changed_at_ms)
    .execute(to)
    .await?;
    inserted(result, KIND, &study.id)
}

pub async fn update(to: &mut SqliteConnection, study: &StudyRecord) -> Written {
    let result = sqlx::query(
        "UPDATE studies SET version = $2, body = $3, changed_at_ms = $4 WHERE id = $1 AND version = $2 - 1",
    )
    .bind(&study.id)
    .bind(study.version)
    .bind(study.body.to_string())
    .bind(study.changed_at_ms)
    .execute(&mut *to)
    .await?;
    if result.rows_affected() > 0 {
        return Ok(());
    }
    let id = study.id.clone();
    let there = sqlx::query("SELECT id FROM studies WHERE id = $1").bind(&id).fetch_optional(to).await?;
    Err(match there {
        Some(_) => StoreError::Changed { kind: KIND, id },
        None => StoreError::NotFound { kind: KIND, id },
    }
    .into())
}

pub async fn delete(to: &mut SqliteConnection, id: &str) -> Written {
    let result = sqlx::query("DELETE FROM studies WHERE id = $1").bind(id).execute(to).await?;
    met(result, KIND, id)
}
