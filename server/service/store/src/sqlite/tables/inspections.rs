//! Inspections.

use serde_json::Value;
use sqlx::sqlite::{SqliteArguments, SqliteRow};
use sqlx::{Sqlite, SqliteConnection, SqlitePool, query::Query};

use crate::catalogue::{InspectionFilter, Listed, Page};
use crate::error::StoreError;
use crate::records::{EventRecord, InspectionRecord};
use crate::sqlite::changes::{Written, inserted, next, refuse_dangling};
use crate::sqlite::error::reading;
use crate::sqlite::listing::{every, listed};
use crate::sqlite::row::{before_id, get, json};
use crate::sqlite::seal;
use crate::sqlite::tables::events;

const KIND: &str = "inspection";

fn from_row(row: &SqliteRow) -> Result<InspectionRecord, StoreError> {
    seal::intact(row, &seal::INSPECTIONS)?;
    Ok(InspectionRecord {
        id: get(row, "id")?,
        seq: get(row, "seq")?,
        serial: get(row, "serial")?,
        order_number: get(row, "order_number")?,
        recipe_id: get(row, "recipe_id")?,
        recipe_version: get(row, "recipe_version")?,
        verdict: get(row, "verdict")?,
        scan_id: get(row, "scan_id")?,
        re_evaluated_from: get(row, "re_evaluated_from")?,
        job_id: get(row, "job_id")?,
        body: json(row, "body")?,
        created_at_ms: get(row, "created_at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<InspectionRecord, StoreError> {
    let row = sqlx::query("SELECT * FROM inspections WHERE id = $1").bind(id).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read an inspection"))? {
        Some(row) => from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }),
    }
}

/// The conditions of a filter, after the start of the page.
macro_rules! select {
    ($place:literal, $order:literal) => {
        concat!(
            "SELECT * FROM inspections WHERE ",
            $place,
            " AND ($2 IS NULL OR serial = $2) AND ($3 IS NULL OR order_number = $3)
             AND ($4 IS NULL OR recipe_id = $4) AND ($5 IS NULL OR recipe_version = $5)
             AND ($6 IS NULL OR verdict = $6)
             AND ($7 IS NULL OR created_at_ms >= $7) AND ($8 IS NULL OR created_at_ms < $8) ORDER BY ",
            $order
        )
    };
}

pub async fn page(
    readers: &SqlitePool,
    filter: &InspectionFilter,
    page: &Page,
) -> Result<Listed<InspectionRecord>, StoreError> {
    let query = sqlx::query(select!("id < $1", "id DESC")).bind(before_id(page));
    let rows = filtered(query, filter).fetch(readers);
    listed(rows, page.limit, "list inspections", from_row, every, |inspection| inspection.id.clone()).await
}

pub async fn after(
    readers: &SqlitePool,
    filter: &InspectionFilter,
    seq: i64,
    limit: u32,
) -> Result<Listed<InspectionRecord>, StoreError> {
    let query = sqlx::query(select!("seq > $1", "seq")).bind(seq);
    let rows = filtered(query, filter).fetch(readers);
    listed(rows, limit, "list inspections", from_row, every, |inspection| inspection.seq.to_string()).await
}

fn filtered<'q>(
    query: Query<'q, Sqlite, SqliteArguments>,
    filter: &'q InspectionFilter,
) -> Query<'q, Sqlite, SqliteArguments> {
    query
        .bind(&filter.serial)
        .bind(&filter.order_number)
        .bind(&filter.recipe_id)
        .bind(filter.recipe_version)
        .bind(&filter.verdict)
        .bind(filter.from_ms)
        .bind(filter.to_ms)
}

/// Record and event get the number of the inspection; the event is returned as stored.
pub async fn insert(
    to: &mut SqliteConnection,
    inspection: InspectionRecord,
    mut event: EventRecord,
) -> Written<EventRecord> {
    let seq = next(to, KIND).await?;
    let result = sqlx::query(
        "INSERT INTO inspections (id, seq, serial, order_number, recipe_id, recipe_version, verdict, scan_id,
             re_evaluated_from, job_id, body, created_at_ms)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12) ON CONFLICT (id) DO NOTHING",
    )
    .bind(&inspection.id)
    .bind(seq)
    .bind(&inspection.serial)
    .bind(&inspection.order_number)
    .bind(&inspection.recipe_id)
    .bind(inspection.recipe_version)
    .bind(&inspection.verdict)
    .bind(&inspection.scan_id)
    .bind(&inspection.re_evaluated_from)
    .bind(&inspection.job_id)
    .bind(inspection.body.to_string())
    .bind(inspection.created_at_ms)
    .execute(&mut *to)
    .await;
    let result = refuse_dangling(result, KIND, &inspection.id, "refers to a scan that does not exist")?;
    inserted(result, KIND, &inspection.id)?;
    event.body["seq"] = Value::from(seq);
    events::append(to, event).await
}
