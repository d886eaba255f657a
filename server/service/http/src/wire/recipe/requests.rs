//! Requests about recipes.

use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};

use crate::wire::recipe::recipes::RecipeDto;

/// Request to create a recipe.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CreateRecipeDto {
    /// Its id: up to 64 of a to z, 0 to 9, `-` and `_`, starting with a letter.
    #[schema(max_length = 64, pattern = "^[a-z][a-z0-9_-]*$", example = "bracket")]
    pub id: String,
    /// Reason for creating it.
    #[schema(max_length = 100)]
    pub reason: String,
    /// The content.
    pub recipe: RecipeDto,
}

/// Request to publish a version of a recipe.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PublishRecipeDto {
    /// Reason for the change.
    #[schema(max_length = 100)]
    pub reason: String,
    /// The complete content.
    pub recipe: RecipeDto,
}

/// Request to publish the content of an earlier version again.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "to_version": 3, "reason": "the new fixture was removed" }))]
pub struct RollBackRecipeDto {
    /// The version whose content is published again.
    pub to_version: i64,
    /// Why.
    #[schema(max_length = 100)]
    pub reason: String,
}

/// Selects recipes.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct RecipesQuery {
    /// Only archived ones, or only those in use.
    pub archived: Option<bool>,
    /// Only the recipe with this number.
    pub number: Option<i64>,
    /// Id of the last recipe of the previous page.
    pub before: Option<String>,
    /// Recipes per page, 1 to 200; default 50.
    #[param(minimum = 1, maximum = 200)]
    pub limit: Option<u32>,
}

/// Selects two versions.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct RecipeDiffQuery {
    /// The earlier version; default: the one before `to`.
    pub from: Option<i64>,
    /// The later version; default: the newest.
    pub to: Option<i64>,
}
