//! Scans.

use sqlx::sqlite::{SqliteArguments, SqliteRow};
use sqlx::{Sqlite, SqliteConnection, SqlitePool, query::Query};

use crate::artifacts::ArtifactId;
use crate::catalogue::{Listed, Page, ScanFilter};
use crate::error::StoreError;
use crate::records::ScanRecord;
use crate::sqlite::changes::{Written, inserted, met, refuse_dangling};
use crate::sqlite::error::reading;
use crate::sqlite::listing::listed;
use crate::sqlite::row::{artifact, before_id, get, json, optional_artifact, word, word_from};
use crate::sqlite::seal;

const KIND: &str = "scan";
const DANGLING: &str = "refers to a calibration, capture or scan that does not exist";

fn from_row(row: &SqliteRow) -> Result<ScanRecord, StoreError> {
    seal::intact(row, &seal::SCANS)?;
    Ok(ScanRecord {
        id: get(row, "id")?,
        name: get(row, "name")?,
        state: word(row, "state")?,
        calibration_id: get(row, "calibration_id")?,
        plan: json(row, "plan")?,
        peaks: artifact(row, "peaks")?,
        capture_id: get(row, "capture_id")?,
        cloud: optional_artifact(row, "cloud")?,
        display: optional_artifact(row, "display")?,
        report: json(row, "report")?,
        recomputed_from: get(row, "recomputed_from")?,
        job_id: get(row, "job_id")?,
        software_version: get(row, "software_version")?,
        created_at_ms: get(row, "created_at_ms")?,
    })
}

pub async fn one(readers: &SqlitePool, id: &str) -> Result<ScanRecord, StoreError> {
    let row = sqlx::query("SELECT * FROM scans WHERE id = $1").bind(id).fetch_optional(readers).await;
    match row.map_err(|cause| reading(cause, "read a scan"))? {
        Some(row) => from_row(&row),
        None => Err(StoreError::NotFound { kind: KIND, id: id.to_owned() }),
    }
}

pub async fn page(
    readers: &SqlitePool,
    filter: &ScanFilter,
    page: &Page,
) -> Result<Listed<ScanRecord>, StoreError> {
    let ScanFilter { state, calibration_id, name, from_ms, to_ms } = filter;
    let rows = sqlx::query(
        "SELECT * FROM scans WHERE id < $1 AND ($2 IS NULL OR state = $2) AND ($3 IS NULL OR calibration_id = $3)
             AND ($4 IS NULL OR name LIKE $4 ESCAPE '\\')
             AND ($5 IS NULL OR created_at_ms >= $5) AND ($6 IS NULL OR created_at_ms < $6)
         ORDER BY id DESC",
    )
    .bind(before_id(page))
    .bind(state.map(word_from))
    .bind(calibration_id)
    .bind(name.as_deref().map(pattern_of))
    .bind(from_ms)
    .bind(to_ms)
    .fetch(readers);
    let wanted_name = name.as_ref().map(|name| name.to_lowercase());
    let has_name =
        |scan: &ScanRecord| wanted_name.as_ref().is_none_or(|wanted| scan.name.to_lowercase().contains(wanted));
    listed(rows, page.limit, "list scans", from_row, has_name, |scan| scan.id.clone()).await
}

/// A pattern of `LIKE` for all names that may contain a text: SQLite compares letters beyond ASCII by case, so they
/// match anything here.
fn pattern_of(text: &str) -> String {
    let mut pattern = String::from("%");
    for letter in text.chars() {
        match letter {
            '%' | '_' | '\\' => pattern.extend(['\\', letter]),
            letter if letter.is_ascii() => pattern.push(letter),
            _ => pattern.push('%'),
        }
    }
    pattern.push('%');
    pattern
}

pub async fn insert(to: &mut SqliteConnection, scan: &ScanRecord) -> Written {
    let query = sqlx::query(
        "INSERT INTO scans (id, name, state, calibration_id, plan, peaks, capture_id, cloud, display, report,
             recomputed_from, job_id, software_version, created_at_ms)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14) ON CONFLICT (id) DO NOTHING",
    );
    let result = refuse_dangling(bind(query, scan).execute(to).await, KIND, &scan.id, DANGLING)?;
    inserted(result, KIND, &scan.id)
}

pub async fn replace(to: &mut SqliteConnection, scan: &ScanRecord) -> Written {
    let query = sqlx::query(
        "UPDATE scans SET name = $2, state = $3, calibration_id = $4, plan = $5, peaks = $6, capture_id = $7,
             cloud = $8, display = $9, report = $10, recomputed_from = $11, job_id = $12, software_version = $13,
             created_at_ms = $14
         WHERE id = $1",
    );
    let result = refuse_dangling(bind(query, scan).execute(to).await, KIND, &scan.id, DANGLING)?;
    met(result, KIND, &scan.id)
}

fn bind<'q>(
    query: Query<'q, Sqlite, SqliteArguments>,
    scan: &'q ScanRecord,
) -> Query<'q, Sqlite, SqliteArguments> {
    query
        .bind(&scan.id)
        .bind(&scan.name)
        .bind(word_from(scan.state))
        .bind(&scan.calibration_id)
        .bind(scan.plan.to_string())
        .bind(scan.peaks.as_str())
        .bind(&scan.capture_id)
        .bind(scan.cloud.as_ref().map(ArtifactId::as_str))
        .bind(scan.display.as_ref().map(ArtifactId::as_str))
        .bind(scan.report.to_string())
        .bind(&scan.recomputed_from)
        .bind(&scan.job_id)
        .bind(&scan.software_version)
        .bind(scan.created_at_ms)
}

/// Also deletes its measurements.
pub async fn delete(to: &mut SqliteConnection, id: &str) -> Written {
    let result = sqlx::query("DELETE FROM scans WHERE id = $1").bind(id).execute(to).await?;
    met(result, KIND, id)
}
