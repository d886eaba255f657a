//! Measurements made on scans.

use sqlx::sqlite::SqliteRow;
use sqlx::{SqliteConnection, SqlitePool};

use crate::catalogue::{Listed, MeasurementFilter, Page};
use crate::error::StoreError;
use crate::records::MeasurementRecord;
use crate::sqlite::changes::{Written, inserted, refuse_dangling};
use crate::sqlite::error::reading;
use crate::sqlite::listing::listed;
use crate::sqlite::row::{before_id, get, json};
use crate::sqlite::seal;

const KIND: &str = "measurement";

fn from_row(row: &SqliteRow) -> Result<MeasurementRecord, StoreError> {
    seal::intact(row, &seal::MEASUREMENTS)?;
    Ok(MeasurementRecord {
        id: get(row, "id")?,
        scan_id: get(row, "scan_id")?,
        request: json(row, "request")?,
        result: json(row, "result")?,
        created_at_ms: get(row, "created_at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<MeasurementRecord, StoreError> {
    let row = sqlx::query("SELECT * FROM measurements WHERE id = $1").bind(id).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a measurement"))? {
        Some(row) => from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }),
    }
}

/// Request and result are JSON documents, filtered here and not in SQL, because a JSON function on a
/// damaged document fails the whole query.
pub async fn page(
    readers: &SqlitePool,
    filter: &MeasurementFilter,
    page: &Page,
) -> Result<Listed<MeasurementRecord>, StoreError> {
    let rows =
        sqlx::query("SELECT * FROM measurements WHERE id < $1 AND ($2 IS NULL OR scan_id = $2) ORDER BY id DESC")
            .bind(before_id(page))
            .bind(&filter.scan_id)
            .fetch(readers);
    let is = |wanted: &Option<String>, found: &serde_json::Value| {
        wanted.as_deref().is_none_or(|wanted| found.as_str() == Some(wanted))
    };
    let wanted = |record: &MeasurementRecord| {
        let verdict = record.result["verdict"].as_str();
        let judged = filter.verdicts.is_empty() || filter.verdicts.iter().any(|word| verdict == Some(word));
        is(&filter.tool, &record.request["tool"]) && judged
    };
    listed(rows, page.limit, "list measurements", from_row, wanted, |record| record.id.clone()).await
}

pub async fn insert(to: &mut SqliteConnection, measurement: &MeasurementRecord) -> Written {
    let result = sqlx::query(
        "INSERT INTO measurements (id, scan_id, request, result, created_at_ms)
         VALUES ($1, $2, $3, $4, $5) ON CONFLICT (id) DO NOTHING",
    )
    .bind(&measurement.id)
    .bind(&measurement.scan_id)
    .bind(measurement.request.to_string())
    .bind(measurement.result.to_string())
    .bind(measurement.created_at_ms)
    .execute(to)
    .await;
    let result = refuse_dangling(result, KIND, &measurement.id, "refers to a scan that does not exist")?;
    inserted(result, KIND, &measurement.id)
}
