//! A recipe as one file, for transfer between stations.

use std::borrow::Cow;

use remedy::Remedy;
use serde::{Deserialize, Serialize};

use crate::error::AppError;
use crate::resources::recipes::check::{check_id, refused};
use crate::resources::recipes::{Recipe, RecipeVersion};

/// Version of the file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum RecipeFormat {
    /// The first.
    #[default]
    #[serde(rename = "sheaf-recipe/1")]
    V1,
}

/// An exported version of a recipe. Only `id`, `digest` and `recipe` are imported; the other fields are informative.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecipeFile {
    /// Version of this document.
    pub format: RecipeFormat,
    /// The recipe.
    pub id: String,
    /// Its version on the station that exported it.
    pub version: i64,
    /// SHA-256 of the canonical content; absent in a file written by hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// Who published it there.
    #[serde(default)]
    pub author: String,
    /// Why.
    #[serde(default)]
    pub reason: String,
    /// The content.
    pub recipe: Recipe,
}

/// Why a file cannot be imported.
#[derive(Debug, thiserror::Error)]
pub enum RecipeFileError {
    /// Not JSON, or another structure.
    #[error("the recipe cannot be read")]
    Json {
        /// Where and why.
        #[source]
        cause: serde_json::Error,
    },
    /// The recipe is invalid.
    #[error("{}: {}", .0.pointer.as_deref().unwrap_or("/"), .0.detail)]
    Recipe(AppError),
}

impl Remedy for RecipeFileError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        match self {
            Self::Json { .. } => Some("export it again from a station".into()),
            Self::Recipe(problem) => problem.remedy.as_deref().map(Cow::from),
        }
    }
}

impl RecipeFile {
    /// The file of a version.
    pub fn of(version: RecipeVersion) -> Self {
        let RecipeVersion { id, version, digest, author, reason, recipe, .. } = version;
        Self { format: RecipeFormat::V1, id, version, digest: Some(digest), author, reason, recipe }
    }

    /// Reads a file and checks it.
    ///
    /// # Errors
    /// [`RecipeFileError`] with the line and column, or the invalid part.
    pub fn from_json(text: &str) -> Result<Self, RecipeFileError> {
        let file: Self = serde_json::from_str(text).map_err(|cause| RecipeFileError::Json { cause })?;
        file.check().map_err(RecipeFileError::Recipe)?;
        Ok(file)
    }

    /// Checks the recipe and its digest.
    ///
    /// # Errors
    /// The invalid part, with its pointer.
    pub fn check(&self) -> Result<(), AppError> {
        check_id(&self.id)?;
        self.recipe.check()?;
        match &self.digest {
            Some(digest) if *digest != self.recipe.digest() => Err(refused(
                "/digest",
                "the recipe does not match its digest",
                "export it again, or omit the digest if the file was changed on purpose",
            )),
            _ => Ok(()),
        }
    }
}
