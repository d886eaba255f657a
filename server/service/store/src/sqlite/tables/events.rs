//! The event log, and the stored responses to requests with an idempotency key.

use serde_json::Value;
use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::Listed;
use crate::error::StoreError;
use crate::records::{EventRecord, IdempotencyRecord};
use crate::sqlite::changes::{Written, inserted, met, next};
use crate::sqlite::error::reading;
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{get, json};
use crate::sqlite::seal;

fn from_row(row: &SqliteRow) -> Result<EventRecord, StoreError> {
    seal::intact(row, &seal::EVENTS)?;
    Ok(EventRecord {
        seq: get(row, "seq")?,
        kind: get(row, "kind")?,
        subject: get(row, "subject")?,
        body: json(row, "body")?,
        at_ms: get(row, "at_ms")?,
    })
}

fn idempotency_from_row(row: &SqliteRow) -> Result<IdempotencyRecord, StoreError> {
    seal::intact(row, &seal::IDEMPOTENCY)?;
    Ok(IdempotencyRecord {
        key: get(row, "key")?,
        body_sha256: get(row, "body_sha256")?,
        answer: json(row, "answer")?,
        created_at_ms: get(row, "created_at_ms")?,
    })
}

pub async fn after(readers: &SqlitePool, seq: i64, limit: u32) -> Result<Listed<EventRecord>, StoreError> {
    let rows = sqlx::query("SELECT * FROM events WHERE seq > $1 ORDER BY seq").bind(seq).fetch(readers);
    listed(rows, limit, "read events", from_row, every, |event| event.seq.to_string()).await
}

/// From the counter, which includes pruned events.
pub async fn last_seq(readers: &SqlitePool) -> Result<i64, StoreError> {
    let row = sqlx::query("SELECT * FROM sequences WHERE name = 'event'")
        .fetch_one(readers)
        .await
        .map_err(|cause| reading(cause, "read the newest event"))?;
    seal::intact(&row, &seal::SEQUENCES)?;
    get(&row, "value")
}

pub async fn append(to: &mut SqliteConnection, event: EventRecord) -> Written<EventRecord> {
    let event = EventRecord { seq: next(to, "event").await?, ..event };
    sqlx::query("INSERT INTO events (seq, kind, subject, body, at_ms) VALUES ($1, $2, $3, $4, $5)")
        .bind(event.seq)
        .bind(&event.kind)
        .bind(&event.subject)
        .bind(event.body.to_string())
        .bind(event.at_ms)
        .execute(&mut *to)
        .await?;
    seal::seal(to, &seal::EVENTS, &event.seq.to_string()).await?;
    Ok(event)
}

pub async fn prune_through(to: &mut SqliteConnection, seq: i64) -> Written {
    sqlx::query("DELETE FROM events WHERE seq <= $1").bind(seq).execute(to).await?;
    Ok(())
}

pub async fn idempotency(readers: &SqlitePool, key: &str) -> Result<Option<IdempotencyRecord>, StoreError> {
    let row = sqlx::query("SELECT * FROM idempotency WHERE key = $1").bind(key).fetch_optional(readers).await;
    row.map_err(|cause| reading(cause, "read an earlier answer"))?.as_ref().map(idempotency_from_row).transpose()
}

pub async fn insert_idempotency(to: &mut SqliteConnection, record: &IdempotencyRecord) -> Written {
    let result = sqlx::query(
        "INSERT INTO idempotency (key, body_sha256, answer, created_at_ms)
         VALUES ($1, $2, $3, $4) ON CONFLICT (key) DO NOTHING",
    )
    .bind(&record.key)
    .bind(&record.body_sha256)
    .bind(record.answer.to_string())
    .bind(record.created_at_ms)
    .execute(to)
    .await?;
    inserted(result, "idempotency key", &record.key)
}

pub async fn answer_idempotency(to: &mut SqliteConnection, key: &str, answer: Option<&Value>) -> Written {
    let query = match answer {
        Some(answer) => {
            sqlx::query("UPDATE idempotency SET answer = $2 WHERE key = $1").bind(key).bind(answer.to_string())
        }
        None => sqlx::query("DELETE FROM idempotency WHERE key = $1").bind(key),
    };
    met(query.execute(to).await?, "idempotency key", key)
}

pub async fn prune_idempotency(to: &mut SqliteConnection, before_ms: i64) -> Written {
    sqlx::query("DELETE FROM idempotency WHERE created_at_ms < $1").bind(before_ms).execute(to).await?;
    Ok(())
}
