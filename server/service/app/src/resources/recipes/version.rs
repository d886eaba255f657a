//! A version of a recipe, and its digest.

use serde_json::Value;
use store::RecipeVersionRecord;

use crate::error::AppError;
use crate::hash_hex;
use crate::resources::recipes::Recipe;

/// A version of a recipe.
#[derive(Debug, Clone, PartialEq)]
pub struct RecipeVersion {
    /// The recipe.
    pub id: String,
    /// From 1.
    pub version: i64,
    /// SHA-256 of the canonical content, hexadecimal.
    pub digest: String,
    /// Who published it.
    pub author: String,
    /// Why.
    pub reason: String,
    /// The earlier version that it restores.
    pub restored_from: Option<i64>,
    /// When.
    pub created_at_ms: i64,
    /// The content.
    pub recipe: Recipe,
}

impl Recipe {
    /// The content as a value.
    pub(crate) fn to_value(&self) -> Value {
        serde_json::to_value(self).expect("a recipe is numbers and texts with text keys")
    }

    /// SHA-256 of the canonical content: JSON without spaces, keys sorted, absent entries omitted.
    pub fn digest(&self) -> String {
        hash_hex(sorted(self.to_value()).to_string().as_bytes())
    }
}

/// The same value with sorted keys.
fn sorted(value: Value) -> Value {
    match value {
        Value::Object(map) => {
            let mut entries: Vec<(String, Value)> = map.into_iter().collect();
            entries.sort_by(|a, b| a.0.cmp(&b.0));
            Value::Object(entries.into_iter().map(|(key, value)| (key, sorted(value))).collect())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(sorted).collect()),
        other => other,
    }
}

impl RecipeVersion {
    /// `bracket@7`.
    pub fn name(&self) -> String {
        format!("{}@{}", self.id, self.version)
    }

    /// Its record.
    pub(crate) fn to_record(&self) -> RecipeVersionRecord {
        RecipeVersionRecord {
            recipe_id: self.id.clone(),
            version: self.version,
            content: self.recipe.to_value(),
            digest: self.digest.clone(),
            author: self.author.clone(),
            reason: self.reason.clone(),
            restored_from: self.restored_from,
            created_at_ms: self.created_at_ms,
        }
    }

    /// From its record.
    ///
    /// # Errors
    /// A problem if it was stored by an incompatible version, or does not match its digest.
    pub fn of(record: RecipeVersionRecord) -> Result<Self, AppError> {
        let RecipeVersionRecord {
            recipe_id,
            version,
            content,
            digest,
            author,
            reason,
            restored_from,
            created_at_ms,
        } = record;
        let damaged =
            |cause: String| AppError::damaged(&format!("version {version} of recipe {recipe_id}"), cause);
        let recipe: Recipe = serde_json::from_value(content).map_err(|cause| damaged(cause.to_string()))?;
        if recipe.digest() != digest {
            return Err(damaged("its digest differs".to_owned()));
        }
        Ok(Self { id: recipe_id, version, digest, author, reason, restored_from, created_at_ms, recipe })
    }
}
