//! Recipes, their versions and their differences, on the wire.

use std::collections::BTreeMap;

use app::recipes::{PlaceChange, Recipe, RecipeFile, RecipeFileModel, RecipeFormat, RecipeVersion};
use serde::{Deserialize, Serialize};
use store::RecipeRecord;
use utoipa::ToSchema;

use crate::wire::recipe::plan_document::PlanDto;
use crate::wire::scan::settings::ScanSettingsDto;

/// How a part is scanned and measured, and its limits. It contains no calibration: an inspection uses the active one.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RecipeDto {
    /// Display name.
    #[schema(max_length = 100)]
    pub name: String,
    /// Number by which a PLC selects it; unique among recipes in use.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1)]
    pub number: Option<u32>,
    /// A regular expression that must match the whole serial number: the recipe is selected for parts that match.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "BR-[0-9]{4}")]
    pub serial_pattern: Option<String>,
    /// How the part is scanned.
    pub scan: ScanSettingsDto,
    /// What is measured, and within which limits.
    pub plan: PlanDto,
    /// Names of the doors that receive its results; default: every door that delivers inspections.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = json!(["mes"]))]
    pub outputs: Option<Vec<String>>,
    /// Passed on with the results, unchanged; attributes of the part with the same names take precedence.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schema(required = false)]
    pub attributes: BTreeMap<String, String>,
}

/// A version of a recipe; it never changes.
#[derive(Debug, Serialize, ToSchema)]
pub struct RecipeVersionDto {
    /// Id of the recipe.
    pub id: String,
    /// From 1 without gaps.
    pub version: i64,
    /// SHA-256 of the canonical content (JSON without spaces, keys sorted), hexadecimal.
    pub digest: String,
    /// Who published it.
    pub author: String,
    /// Why.
    pub reason: String,
    /// The earlier version that it restores.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restored_from: Option<i64>,
    /// Time of publication, ms since 1970 (UTC).
    pub created_at_ms: i64,
    /// The content.
    pub recipe: RecipeDto,
}

/// A recipe with its newest version.
#[derive(Debug, Serialize, ToSchema)]
pub struct NewestRecipeDto {
    /// Archived: no part can be inspected with it.
    pub archived: bool,
    /// The version.
    #[serde(flatten)]
    pub newest: RecipeVersionDto,
}

/// A recipe in a list.
#[derive(Debug, Serialize, ToSchema)]
pub struct RecipeItemDto {
    /// Its id.
    pub id: String,
    /// Its newest version.
    pub version: i64,
    /// Digest of that version.
    pub digest: String,
    /// Display name.
    pub name: String,
    /// Number by which a PLC selects it.
    pub number: Option<u32>,
    /// A regular expression that must match the whole serial number.
    pub serial_pattern: Option<String>,
    /// Archived.
    pub archived: bool,
    /// Who published the newest version.
    pub author: String,
    /// Why.
    pub reason: String,
    /// When, ms since 1970 (UTC).
    pub created_at_ms: i64,
}

/// Version of the document.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
pub enum RecipeFormatDto {
    /// The first.
    #[serde(rename = "sheaf-recipe/1")]
    V1,
}

/// A CAD model in the file of a recipe.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RecipeFileModelDto {
    /// File name; its extension determines the format.
    pub name: String,
    /// SHA-256 of the file, by which the recipe names it.
    pub sha256: String,
    /// The file, in base64.
    pub content_base64: String,
}

/// A version of a recipe as one file. Only `id`, `digest`, `recipe` and `models` are imported; the other fields are
/// informative.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RecipeFileDto {
    /// Version of this document.
    pub format: RecipeFormatDto,
    /// Id of the recipe.
    pub id: String,
    /// Its version on the station that exported it.
    pub version: i64,
    /// SHA-256 of the canonical content; omit it in a file written by hand.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// Who published it there.
    #[serde(default)]
    pub author: String,
    /// Why.
    #[serde(default)]
    pub reason: String,
    /// The content.
    pub recipe: RecipeDto,
    /// The CAD models that it names; one that is missing must be stored at the station that imports the file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<RecipeFileModelDto>,
}

/// Differences between two versions.
#[derive(Debug, Serialize, ToSchema)]
pub struct RecipeDifferenceDto {
    /// The earlier version.
    pub from: i64,
    /// The later version.
    pub to: i64,
    /// The changes.
    pub changes: Vec<PlaceChangeDto>,
}

/// A change.
#[derive(Debug, Serialize, ToSchema)]
pub struct PlaceChangeDto {
    /// JSON pointer; features and characteristics are named by their id instead of their number.
    #[schema(example = "/plan/characteristics/height/upper")]
    pub place: String,
    /// Old value, as JSON; absent if added.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "0.05")]
    pub old: Option<String>,
    /// New value, as JSON; absent if removed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "0.1")]
    pub new: Option<String>,
}

/// URL of a recipe.
pub fn recipe_href(id: &str) -> String {
    format!("/api/v1/recipes/{id}")
}

/// URL of a version of a recipe.
pub fn version_href(id: &str, version: i64) -> String {
    format!("{}/versions/{version}", recipe_href(id))
}

impl From<RecipeDto> for Recipe {
    fn from(dto: RecipeDto) -> Self {
        let RecipeDto { name, number, serial_pattern, scan, plan, outputs, attributes } = dto;
        Self { name, number, serial_pattern, scan: scan.into(), plan: plan.0, outputs, attributes }
    }
}

impl From<Recipe> for RecipeDto {
    fn from(recipe: Recipe) -> Self {
        let Recipe { name, number, serial_pattern, scan, plan, outputs, attributes } = recipe;
        Self { name, number, serial_pattern, scan: scan.into(), plan: PlanDto(plan), outputs, attributes }
    }
}

impl From<RecipeVersion> for RecipeVersionDto {
    fn from(version: RecipeVersion) -> Self {
        let RecipeVersion { id, version, digest, author, reason, restored_from, created_at_ms, recipe } = version;
        Self { id, version, digest, author, reason, restored_from, created_at_ms, recipe: recipe.into() }
    }
}

impl From<(RecipeRecord, RecipeVersion)> for RecipeItemDto {
    fn from((record, newest): (RecipeRecord, RecipeVersion)) -> Self {
        Self {
            id: newest.id,
            version: newest.version,
            digest: newest.digest,
            name: newest.recipe.name,
            number: newest.recipe.number,
            serial_pattern: newest.recipe.serial_pattern,
            archived: record.archived,
            author: newest.author,
            reason: newest.reason,
            created_at_ms: newest.created_at_ms,
        }
    }
}

impl From<RecipeFileDto> for RecipeFile {
    fn from(dto: RecipeFileDto) -> Self {
        let RecipeFileDto { format: RecipeFormatDto::V1, id, version, digest, author, reason, recipe, models } =
            dto;
        let model =
            |RecipeFileModelDto { name, sha256, content_base64 }| RecipeFileModel { name, sha256, content_base64 };
        let models = models.into_iter().map(model).collect();
        Self { format: RecipeFormat::V1, id, version, digest, author, reason, recipe: recipe.into(), models }
    }
}

impl From<RecipeFile> for RecipeFileDto {
    fn from(file: RecipeFile) -> Self {
        let RecipeFile { format: RecipeFormat::V1, id, version, digest, author, reason, recipe, models } = file;
        let model =
            |RecipeFileModel { name, sha256, content_base64 }| RecipeFileModelDto { name, sha256, content_base64 };
        let models = models.into_iter().map(model).collect();
        Self { format: RecipeFormatDto::V1, id, version, digest, author, reason, recipe: recipe.into(), models }
    }
}

impl From<PlaceChange> for PlaceChangeDto {
    fn from(change: PlaceChange) -> Self {
        let PlaceChange { place, old, new } = change;
        Self { place, old, new }
    }
}
