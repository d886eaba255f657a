//! Which artifacts the catalogue names.

use std::collections::HashSet;

use futures_util::TryStreamExt;
use sqlx::SqlitePool;

use crate::artifacts::ArtifactId;
use crate::catalogue::StoreError;
use crate::sqlite::error::reading;

/// Every column that is an artifact's id, and every document that may hold some. One statement, so that all of them
/// are read from the same moment.
const TEXTS: &str = "
    SELECT archive AS text FROM captures
    UNION ALL SELECT summary FROM captures
    UNION ALL SELECT document FROM calibrations
    UNION ALL SELECT report FROM calibrations WHERE report IS NOT NULL
    UNION ALL SELECT summary FROM calibrations
    UNION ALL SELECT peaks FROM scans
    UNION ALL SELECT cloud FROM scans WHERE cloud IS NOT NULL
    UNION ALL SELECT display FROM scans WHERE display IS NOT NULL
    UNION ALL SELECT plan FROM scans
    UNION ALL SELECT report FROM scans
    UNION ALL SELECT request FROM measurements
    UNION ALL SELECT result FROM measurements
    UNION ALL SELECT body FROM sessions
    UNION ALL SELECT input FROM jobs
    UNION ALL SELECT checkpoint FROM jobs WHERE checkpoint IS NOT NULL
    UNION ALL SELECT result_id FROM jobs WHERE result_id IS NOT NULL";

/// All artifacts that any record names. A document's own business is not known here, so whatever looks like an
/// artifact's id in it counts as one: an artifact is rather kept too long than lost.
pub async fn artifacts(readers: &SqlitePool) -> Result<HashSet<ArtifactId>, StoreError> {
    let mut texts = sqlx::query_scalar::<_, String>(TEXTS).fetch(readers);
    let mut named = HashSet::new();
    while let Some(text) = texts.try_next().await.map_err(|cause| reading(cause, "list artifacts"))? {
        named.extend(ids_in(&text));
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
