//! Sessions, changed with optimistic concurrency: each change names the version it follows.

use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::{Listed, Page};
use crate::error::StoreError;
use crate::records::SessionRecord;
use crate::sqlite::changes::{Written, inserted, met};
use crate::sqlite::error::reading;
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{before_id, get, json};
use crate::sqlite::seal;

const KIND: &str = "session";

fn from_row(row: &SqliteRow) -> Result<SessionRecord, StoreError> {
    seal::intact(row, &seal::SESSIONS)?;
    Ok(SessionRecord {
        id: get(row, "id")?,
        version: get(row, "version")?,
        body: json(row, "body")?,
        created_at_ms: get(row, "created_at_ms")?,
        changed_at_ms: get(row, "changed_at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<SessionRecord, StoreError> {
    let row = sqlx::query("SELECT * FROM sessions WHERE id = $1").bind(id).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a session"))? {
        Some(row) => from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }),
    }
}

pub async fn page(readers: &SqlitePool, page: &Page) -> Result<Listed<SessionRecord>, StoreError> {
    let rows =
        sqlx::query("SELECT * FROM sessions WHERE id < $1 ORDER BY id DESC").bind(before_id(page)).fetch(readers);
    listed(rows, page.limit, "list sessions", from_row, every, |session| session.id.clone()).await
}

pub async fn insert(to: &mut SqliteConnection, session: &SessionRecord) -> Written {
    let result = sqlx::query(
        "INSERT INTO sessions (id, version, body, created_at_ms, changed_at_ms)
         VALUES ($1, $2, $3, $4, $5) ON CONFLICT (id) DO NOTHING",
    )
    .bind(&session.id)
    .bind(session.version)
    .bind(session.body.to_string())
    .bind(session.created_at_ms)
    .bind(session.changed_at_ms)
    .execute(to)
    .await?;
    inserted(result, KIND, &session.id)
}

pub async fn update(to: &mut SqliteConnection, session: &SessionRecord) -> Written {
    let result = sqlx::query(
        "UPDATE sessions SET version = $2, body = $3, changed_at_ms = $4 WHERE id = $1 AND version = $2 - 1",
    )
    .bind(&session.id)
    .bind(session.version)
    .bind(session.body.to_string())
    .bind(session.changed_at_ms)
    .execute(&mut *to)
    .await?;
    if result.rows_affected() > 0 {
        return Ok(());
    }
    let id = session.id.clone();
    let there = sqlx::query("SELECT id FROM sessions WHERE id = $1").bind(&id).fetch_optional(to).await?;
    Err(match there {
        Some(_) => StoreError::Changed { kind: KIND, id },
        None => StoreError::NotFound { kind: KIND, id },
    }
    .into())
}

pub async fn delete(to: &mut SqliteConnection, id: &str) -> Written {
    let result = sqlx::query("DELETE FROM sessions WHERE id = $1").bind(id).execute(to).await?;
    met(result, KIND, id)
}
