//! A recipe as one file, to be moved between stations.

use std::borrow::Cow;

use remedy::Remedy;
use serde::{Deserialize, Serialize};

use crate::error::AppError;
use crate::resources::recipes::check::{check_id, refused};
use crate::resources::recipes::{Recipe, RecipeVersion};

/// The version of the document.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum RecipeFormat {
    /// The first.
    #[default]
    #[serde(rename = "sheaf-recipe/1")]
    V1,
}

/// An exported version of a recipe. Where it came from is for people; only `id`, `digest` and `recipe` are imported.
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
    /// What is scanned, measured and judged.
    pub recipe: Recipe,
}

/// A file that is no recipe.
#[derive(Debug, thiserror::Error)]
pub enum RecipeFileError {
    /// No JSON, or not of this form.
    #[error("the recipe cannot be read")]
    Json {
        /// Where and why.
        #[source]
        cause: serde_json::Error,
    },
    /// A part of it is wrong.
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
    /// [`RecipeFileError`] with the line and column, or the part that is wrong.
    pub fn from_json(text: &str) -> Result<Self, RecipeFileError> {
        let file: Self = serde_json::from_str(text).map_err(|cause| RecipeFileError::Json { cause })?;
        file.check().map_err(RecipeFileError::Recipe)?;
        Ok(file)
    }

    /// Checks the recipe, and that it is the one that was exported.
    ///
    /// # Errors
    /// The part that is wrong, with its place.
    pub fn check(&self) -> Result<(), AppError> {
        check_id(&self.id)?;
        self.recipe.check()?;
        match &self.digest {
            Some(digest) if *digest != self.recipe.digest() => Err(refused(
                "/digest",
                "the recipe is not the one that was exported: its digest differs",
                "export it again, or leave out the digest of a file that was changed on purpose",
            )),
            _ => Ok(()),
        }
    }
}
