//! Doors and the deliveries they have set aside.

use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::{DeliveryFilter, Listed, SetAside};
use crate::error::StoreError;
use crate::records::{DeliveryRecord, DeliveryState, DoorRecord, EventRecord};
use crate::sqlite::changes::{Written, met};
use crate::sqlite::error::reading;
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{get, json, word, word_from};
use crate::sqlite::seal;

const KIND: &str = "delivery";

fn door_from_row(row: &SqliteRow) -> Result<DoorRecord, StoreError> {
    seal::intact(row, &seal::DOORS)?;
    Ok(DoorRecord {
        name: get(row, "name")?,
        seq: get(row, "seq")?,
        n_delivered: get(row, "n_delivered")?,
        delivered_seq: get(row, "delivered_seq")?,
        delivered_at_ms: get(row, "delivered_at_ms")?,
    })
}

fn delivery_from_row(row: &SqliteRow) -> Result<DeliveryRecord, StoreError> {
    seal::intact(row, &seal::DELIVERIES)?;
    Ok(DeliveryRecord {
        door: get(row, "door")?,
        event: EventRecord {
            seq: get(row, "seq")?,
            kind: get(row, "kind")?,
            subject: get(row, "subject")?,
            body: json(row, "body")?,
            at_ms: get(row, "at_ms")?,
        },
        state: word(row, "state")?,
        n_attempts: get(row, "n_attempts")?,
        next_at_ms: get(row, "next_at_ms")?,
        reason: get(row, "reason")?,
    })
}

/// The key of a delivery.
pub fn key(door: &str, seq: i64) -> String {
    format!("{door}/{seq}")
}

pub async fn one(readers: &SqlitePool, name: &str) -> Result<Option<DoorRecord>, StoreError> {
    let row = sqlx::query("SELECT * FROM doors WHERE name = $1").bind(name).fetch_optional(readers).await;
    row.map_err(|cause| reading(cause, "read a door"))?.as_ref().map(door_from_row).transpose()
}

pub async fn delivery(readers: &SqlitePool, door: &str, seq: i64) -> Result<DeliveryRecord, StoreError> {
    let key = key(door, seq);
    let row = sqlx::query("SELECT * FROM deliveries WHERE key = $1").bind(&key).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a delivery"))? {
        Some(row) => delivery_from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: key }),
    }
}

pub async fn deliveries(
    readers: &SqlitePool,
    filter: &DeliveryFilter,
    after_seq: i64,
    limit: u32,
) -> Result<Listed<DeliveryRecord>, StoreError> {
    let rows = sqlx::query(
        "SELECT * FROM deliveries WHERE door = $1 AND seq > $2 AND ($3 IS NULL OR state = $3)
         AND ($4 IS NULL OR next_at_ms <= $4) ORDER BY seq",
    )
    .bind(&filter.door)
    .bind(after_seq)
    .bind(filter.state.map(word_from))
    .bind(filter.due_at_ms)
    .fetch(readers);
    listed(rows, limit, "list deliveries", delivery_from_row, every, |one| one.event.seq.to_string()).await
}

/// Counted from the rows themselves, each verified; dead letters are few, since people attend to them.
pub async fn set_aside(readers: &SqlitePool, door: &str) -> Result<SetAside, StoreError> {
    let all = DeliveryFilter { door: door.to_owned(), state: None, due_at_ms: None };
    let mut counted = SetAside::default();
    for record in deliveries(readers, &all, 0, u32::MAX).await?.whole()? {
        match record.state {
            DeliveryState::Dead => counted.n_dead += 1,
            DeliveryState::Waiting => {
                counted.n_waiting += 1;
                let next_at_ms = counted.next_at_ms.unwrap_or(i64::MAX).min(record.next_at_ms);
                counted.next_at_ms = Some(next_at_ms);
            }
        }
    }
    Ok(counted)
}

pub async fn put(to: &mut SqliteConnection, door: &DoorRecord) -> Written {
    sqlx::query(
        "INSERT INTO doors (name, seq, n_delivered, delivered_seq, delivered_at_ms) VALUES ($1, $2, $3, $4, $5)
         ON CONFLICT (name) DO UPDATE
         SET seq = $2, n_delivered = $3, delivered_seq = $4, delivered_at_ms = $5",
    )
    .bind(&door.name)
    .bind(door.seq)
    .bind(door.n_delivered)
    .bind(door.delivered_seq)
    .bind(door.delivered_at_ms)
    .execute(to)
    .await?;
    Ok(())
}

pub async fn put_delivery(to: &mut SqliteConnection, delivery: &DeliveryRecord) -> Written {
    let DeliveryRecord { door, event, state, n_attempts, next_at_ms, reason } = delivery;
    sqlx::query(
        "INSERT INTO deliveries (key, door, seq, kind, subject, body, at_ms, state, n_attempts, next_at_ms, reason)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11)
         ON CONFLICT (key) DO UPDATE SET state = $8, n_attempts = $9, next_at_ms = $10, reason = $11",
    )
    .bind(key(door, event.seq))
    .bind(door)
    .bind(event.seq)
    .bind(&event.kind)
    .bind(&event.subject)
    .bind(event.body.to_string())
    .bind(event.at_ms)
    .bind(word_from(*state))
    .bind(n_attempts)
    .bind(next_at_ms)
    .bind(reason)
    .execute(to)
    .await?;
    Ok(())
}

pub async fn delete_delivery(to: &mut SqliteConnection, key: &str) -> Written {
    let result = sqlx::query("DELETE FROM deliveries WHERE key = $1").bind(key).execute(to).await?;
    met(result, KIND, key)
}
