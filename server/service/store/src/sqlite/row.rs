//! Columns ↔ fields.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use sqlx::sqlite::SqliteRow;
use sqlx::{Decode, Row, Sqlite, Type};

use crate::artifacts::ArtifactId;
use crate::catalogue::Page;
use crate::error::StoreError;
use crate::sqlite::error;

/// Sorts after every id, whatever the collation: ids are hexadecimal.
const AFTER_EVERY_ID: &str = "z";

/// The id below which a page starts.
pub fn before_id(page: &Page) -> &str {
    page.before.as_deref().unwrap_or(AFTER_EVERY_ID)
}

/// A column that does not parse as JSON document, artifact id, state, ….
#[derive(Debug, thiserror::Error)]
#[error("column {column} holds {text:?}")]
struct BadColumn {
    column: &'static str,
    text: String,
}

fn bad(column: &'static str, text: &str) -> StoreError {
    StoreError::Database { what: "read a record", cause: Box::new(BadColumn { column, text: text.to_owned() }) }
}

/// A column, unparsed.
pub fn get<'r, T: Decode<'r, Sqlite> + Type<Sqlite>>(
    row: &'r SqliteRow,
    column: &'static str,
) -> Result<T, StoreError> {
    row.try_get(column).map_err(|cause| error::reading(cause, "read a record"))
}

/// A JSON document.
pub fn json(row: &SqliteRow, column: &'static str) -> Result<Value, StoreError> {
    let text: &str = get(row, column)?;
    serde_json::from_str(text).map_err(|_| bad(column, text))
}

/// A JSON document, if there is one.
pub fn optional_json(row: &SqliteRow, column: &'static str) -> Result<Option<Value>, StoreError> {
    let text: Option<&str> = get(row, column)?;
    text.map(|text| serde_json::from_str(text).map_err(|_| bad(column, text))).transpose()
}

/// An artifact's id.
pub fn artifact(row: &SqliteRow, column: &'static str) -> Result<ArtifactId, StoreError> {
    let text: &str = get(row, column)?;
    ArtifactId::parse(text).ok_or_else(|| bad(column, text))
}

/// An artifact's id, if there is one.
pub fn optional_artifact(row: &SqliteRow, column: &'static str) -> Result<Option<ArtifactId>, StoreError> {
    let text: Option<&str> = get(row, column)?;
    text.map(|text| ArtifactId::parse(text).ok_or_else(|| bad(column, text))).transpose()
}

/// A variant of an enum by its name.
pub fn word<T: DeserializeOwned>(row: &SqliteRow, column: &'static str) -> Result<T, StoreError> {
    let text: &str = get(row, column)?;
    serde_json::from_value(Value::from(text)).map_err(|_| bad(column, text))
}

/// The name of a variant without fields.
pub fn word_from<T: Serialize>(value: T) -> String {
    match serde_json::to_value(value) {
        Ok(Value::String(word)) => word,
        _ => unreachable!("states are enums without fields, which serde writes as words"),
    }
}

/// A count of bytes.
pub fn size_bytes(row: &SqliteRow, column: &'static str) -> Result<u64, StoreError> {
    let value: i64 = get(row, column)?;
    u64::try_from(value).map_err(|_| bad(column, &value.to_string()))
}
