//! A recipe as one file, for transfer between stations.

use std::borrow::Cow;

use base64::prelude::{BASE64_STANDARD, Engine as _};
use metrology::ModelRef;
use remedy::Remedy;
use serde::{Deserialize, Serialize};

use crate::error::AppError;
use crate::hash_hex;
use crate::resources::models::named_by;
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

/// A CAD model that a recipe names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecipeFileModel {
    /// File name.
    pub name: String,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
    /// The file, in base64.
    pub content_base64: String,
}

/// A model taken from a recipe file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelFile {
    /// File name.
    pub name: String,
    /// SHA-256, hexadecimal, in lower case.
    pub sha256: String,
    /// The file.
    pub bytes: Vec<u8>,
}

/// An exported version of a recipe. Only `id`, `digest`, `recipe` and `models` are imported; the other fields are
/// informative.
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
    /// The CAD models that it names; one that is missing must be stored at the station that imports the file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<RecipeFileModel>,
}

impl RecipeFileModel {
    /// A model with its file.
    pub fn of(model: &ModelRef, bytes: &[u8]) -> Self {
        let ModelRef { name, sha256 } = model.clone();
        Self { name, sha256, content_base64: BASE64_STANDARD.encode(bytes) }
    }
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
    /// The file of a version with the models that it names.
    pub fn of(version: RecipeVersion, models: Vec<RecipeFileModel>) -> Self {
        let RecipeVersion { id, version, digest, author, reason, recipe, .. } = version;
        Self { format: RecipeFormat::V1, id, version, digest: Some(digest), author, reason, recipe, models }
    }

    /// The files of its models.
    ///
    /// # Errors
    /// One is damaged, or no characteristic names it, at its pointer.
    pub fn model_files(&self) -> Result<Vec<ModelFile>, AppError> {
        let file = |(idx, model): (usize, &RecipeFileModel)| {
            let refuse = |field: &str, detail: String, remedy: &str| {
                Err(refused(format!("/models/{idx}{field}"), format!("the model {} {detail}", model.name), remedy))
            };
            let sha256 = model.sha256.to_ascii_lowercase();
            if !named_by(&self.recipe.plan).any(|(_, named)| named.sha256.eq_ignore_ascii_case(&sha256)) {
                return refuse("", "is not named by the recipe".to_owned(), "remove it from the file");
            }
            let Ok(bytes) = BASE64_STANDARD.decode(&model.content_base64) else {
                return refuse("/content_base64", "is not base64".to_owned(), "export the recipe again");
            };
            let actual = hash_hex(&bytes);
            if actual != sha256 {
                let detail = format!("has the SHA-256 {actual}, not {sha256}");
                return refuse("/content_base64", detail, "export the recipe again");
            }
            Ok(ModelFile { name: model.name.clone(), sha256, bytes })
        };
        self.models.iter().enumerate().map(file).collect()
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
