//! The artifacts that the catalogue refers to.

use std::collections::HashSet;

use futures_util::TryStreamExt;
use sqlx::sqlite::SqliteRow;
use sqlx::{Row, SqlitePool};

use crate::artifacts::ArtifactId;
use crate::error::StoreError;
use crate::sqlite::error::reading;
use crate::sqlite::seal::{self, Table};

/// The tables that refer to artifacts, in columns or in documents.
const TABLES: [Table; 9] = [
    seal::CAPTURES,
    seal::RECORDINGS,
    seal::CALIBRATIONS,
    seal::SCANS,
    seal::MEASUREMENTS,
    seal::MODELS,
    seal::RECIPE_VERSIONS,
    seal::SESSIONS,
    seal::JOBS,
];

/// Whether rows of this table refer to artifacts.
pub fn is_named_by(table: &Table) -> bool {
    TABLES.contains(table)
}

/// The artifacts that a row refers to.
pub fn in_row(row: &SqliteRow) -> HashSet<ArtifactId> {
    let texts = (0..row.columns().len()).filter_map(|idx| row.try_get::<&str, _>(idx).ok());
    texts.flat_map(ids_in).collect()
}

/// All artifacts that any record refers to. The structure of documents is unknown here, so any text that looks like an
/// artifact id counts as a reference: keeping an artifact too long is better than losing it. Everything is kept while a
/// record is damaged.
pub async fn artifacts(readers: &SqlitePool) -> Result<HashSet<ArtifactId>, StoreError> {
    const WHAT: &str = "list artifacts";
    // One transaction: all tables are read from the same snapshot.
    let mut moment = readers.begin().await.map_err(|cause| reading(cause, WHAT))?;
    let mut named = HashSet::new();
    for table in &TABLES {
        let statement = format!("SELECT * FROM {}", table.name);
        let mut rows = sqlx::query(sqlx::AssertSqlSafe(statement)).fetch(&mut *moment);
        while let Some(row) = rows.try_next().await.map_err(|cause| reading(cause, WHAT))? {
            seal::intact(&row, table)?;
            named.extend(in_row(&row));
        }
    }
    Ok(named)
}

fn ids_in(text: &str) -> impl Iterator<Item = ArtifactId> {
    text.split(|letter: char| !letter.is_ascii_alphanumeric()).filter_map(ArtifactId::parse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_found_in_columns_and_in_documents() {
        let (a, b) = ("a".repeat(64), "0".repeat(64));
        let document = serde_json::json!({"pictures": [{"artifact": a}, b], "other": "f".repeat(63)}).to_string();
        let found: Vec<_> = ids_in(&document).map(|id| id.as_str().to_owned()).collect();
        assert_eq!(found, [a.clone(), b]);
        assert_eq!(ids_in(&a).count(), 1);
    }
}
