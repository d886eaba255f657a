//! A checksum in every row, so that corrupted data is detected when it is read.
//!
//! A row is verified before it is changed and sealed afterwards, in the same transaction: a change never hides damage.

use sha2::{Digest, Sha256};
use sqlx::sqlite::SqliteRow;
use sqlx::{Column, Connection, Row, SqliteConnection, TypeInfo, ValueRef};

use crate::error::StoreError;
use crate::sqlite::changes::{WriteError, Written};
use crate::sqlite::error::{self, reading};

/// Stored bytes of the hash: damage goes undetected with probability 2⁻⁶⁴.
const SEAL_BYTES: usize = 8;

/// The column of the checksum.
const SEAL: &str = "seal";

/// A table of records.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Table {
    /// Its name.
    pub name: &'static str,
    /// Its key.
    pub key: &'static str,
    /// Kind of its records, for messages.
    pub kind: &'static str,
}

pub const SEQUENCES: Table = Table { name: "sequences", key: "name", kind: "counter" };
pub const JOBS: Table = Table { name: "jobs", key: "id", kind: "job" };
pub const CAPTURES: Table = Table { name: "captures", key: "id", kind: "capture" };
pub const RECORDINGS: Table = Table { name: "recordings", key: "id", kind: "recording" };
pub const CALIBRATIONS: Table = Table { name: "calibrations", key: "id", kind: "calibration" };
pub const ACTIVATIONS: Table = Table { name: "activations", key: "seq", kind: "activation" };
pub const SCANS: Table = Table { name: "scans", key: "id", kind: "scan" };
pub const MEASUREMENTS: Table = Table { name: "measurements", key: "id", kind: "measurement" };
pub const MODELS: Table = Table { name: "models", key: "id", kind: "model" };
pub const RECIPES: Table = Table { name: "recipes", key: "id", kind: "recipe" };
pub const RECIPE_VERSIONS: Table = Table { name: "recipe_versions", key: "key", kind: "recipe version" };
pub const INSPECTIONS: Table = Table { name: "inspections", key: "id", kind: "inspection" };
pub const SESSIONS: Table = Table { name: "sessions", key: "id", kind: "session" };
pub const STUDIES: Table = Table { name: "studies", key: "id", kind: "study" };
pub const EVENTS: Table = Table { name: "events", key: "seq", kind: "event" };
pub const SETTINGS: Table = Table { name: "settings", key: "name", kind: "setting" };
pub const DOORS: Table = Table { name: "doors", key: "name", kind: "door" };
pub const DELIVERIES: Table = Table { name: "deliveries", key: "key", kind: "delivery" };
pub const IDEMPOTENCY: Table = Table { name: "idempotency", key: "key", kind: "idempotency key" };

/// All of them.
pub const TABLES: [Table; 12] = [
    SEQUENCES,
    JOBS,
    CAPTURES,
    RECORDINGS,
    CALIBRATIONS,
    ACTIVATIONS,
    SCANS,
    MEASUREMENTS,
    SESSIONS,
    SETTINGS,
    EVENTS,
    IDEMPOTENCY,
];

/// Refuses a row whose checksum does not match.
pub fn intact(row: &SqliteRow, table: &Table) -> Result<(), StoreError> {
    let seal = row.try_get::<&str, _>(SEAL);
    if seal.is_ok_and(|seal| seal == seal_of(row)) {
        return Ok(());
    }
    Err(StoreError::DamagedRecord { kind: table.kind, id: key_of(row, table) })
}

/// The row to be changed, if it exists; refuses a damaged one.
pub async fn verify(to: &mut SqliteConnection, table: &Table, key: &str) -> Written<Option<SqliteRow>> {
    let row = row(to, table, key).await?;
    row.as_ref().map_or(Ok(()), |row| intact(row, table))?;
    Ok(row)
}

/// Updates the checksum of a row that was written or changed, and returns the row.
pub async fn seal(to: &mut SqliteConnection, table: &Table, key: &str) -> Written<Option<SqliteRow>> {
    let Some(row) = row(to, table, key).await? else { return Ok(None) };
    let statement = format!("UPDATE {} SET {SEAL} = $1 WHERE {} = $2", table.name, table.key);
    sqlx::query(sqlx::AssertSqlSafe(statement)).bind(seal_of(&row)).bind(key).execute(to).await?;
    Ok(Some(row))
}

/// Keys of the intact rows whose `column` is `id`. Damaged ones keep the checksum that does not match.
pub async fn naming(
    to: &mut SqliteConnection,
    table: &Table,
    column: &'static str,
    id: &str,
) -> Written<Vec<(Table, String)>> {
    let statement = format!("SELECT * FROM {} WHERE {column} = $1", table.name);
    let rows = sqlx::query(sqlx::AssertSqlSafe(statement)).bind(id).fetch_all(to).await?;
    let intact = rows.iter().filter(|row| intact(row, table).is_ok());
    Ok(intact.map(|row| (*table, key_of(row, table))).collect())
}

/// Seals all rows once, in a database whose rows had no seals.
pub async fn seal_old_rows(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    const WHAT: &str = "seal the records of an older database";
    let unsealed = sqlx::query("SELECT name FROM sqlite_master WHERE name = 'unsealed'")
        .fetch_optional(&mut *connection)
        .await
        .map_err(|cause| reading(cause, WHAT))?;
    if unsealed.is_none() {
        return Ok(());
    }
    seal_all(connection).await.map_err(|cause| error::opening(cause, WHAT))
}

async fn seal_all(connection: &mut SqliteConnection) -> Result<(), sqlx::Error> {
    let mut transaction = connection.begin().await?;
    for table in &TABLES {
        let keys = format!("SELECT CAST({} AS TEXT) FROM {}", table.key, table.name);
        let keys: Vec<String> = sqlx::query_scalar(sqlx::AssertSqlSafe(keys)).fetch_all(&mut *transaction).await?;
        for key in keys {
            match seal(&mut transaction, table, &key).await {
                Err(WriteError::Database(cause)) => return Err(cause),
                Err(WriteError::Rule(_)) | Ok(_) => {}
            }
        }
    }
    sqlx::raw_sql("DROP TABLE unsealed").execute(&mut *transaction).await?;
    transaction.commit().await
}

async fn row(to: &mut SqliteConnection, table: &Table, key: &str) -> Written<Option<SqliteRow>> {
    let statement = format!("SELECT * FROM {} WHERE {} = $1", table.name, table.key);
    Ok(sqlx::query(sqlx::AssertSqlSafe(statement)).bind(key).fetch_optional(to).await?)
}

/// The key as stored, even if the row is damaged.
fn key_of(row: &SqliteRow, table: &Table) -> String {
    let number = || row.try_get::<i64, _>(table.key).ok().map(|number| number.to_string());
    row.try_get::<String, _>(table.key).ok().or_else(number).unwrap_or_else(|| "of unreadable key".to_owned())
}

/// Hash of name, type and value of every column but the seal.
fn seal_of(row: &SqliteRow) -> String {
    let mut hash = Sha256::new();
    for (idx, column) in row.columns().iter().enumerate().filter(|(_, column)| column.name() != SEAL) {
        hash.update(column.name());
        let kind = match row.try_get_raw(idx) {
            Ok(value) if value.is_null() => "NULL".to_owned(),
            Ok(value) => value.type_info().name().to_owned(),
            Err(_) => "none".to_owned(),
        };
        let bytes = match kind.as_str() {
            "NULL" | "none" => Vec::new(),
            "INTEGER" => row.try_get_unchecked::<i64, _>(idx).map_or(Vec::new(), |x| x.to_le_bytes().to_vec()),
            "REAL" => row.try_get_unchecked::<f64, _>(idx).map_or(Vec::new(), |x| x.to_le_bytes().to_vec()),
            _ => row.try_get_unchecked::<Vec<u8>, _>(idx).unwrap_or_default(),
        };
        hash.update([0]);
        hash.update(&kind);
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(&bytes);
    }
    hash.finalize()[..SEAL_BYTES].iter().map(|byte| format!("{byte:02x}")).collect()
}
