//! Looking up a recipe by id, version, number, or serial number of the part.

use store::{Page, RecipeFilter, RecipeRecord};

use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::resources::recipes::RecipeVersion;
use crate::resources::recipes::check::refused;
use crate::resources::recipes::serial_rule::SerialRule;

/// A reference to a recipe.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RecipeRef {
    /// `bracket`: its newest version; `bracket@7`: this one.
    Id {
        /// The recipe.
        id: String,
        /// The version; `None`: the newest.
        version: Option<i64>,
    },
    /// Number by which a PLC selects it.
    Number(i64),
}

impl RecipeRef {
    /// Parses `bracket`, `bracket@7` or `12`.
    pub fn parse(text: &str) -> Option<Self> {
        if let Ok(number) = text.parse() {
            return Some(Self::Number(number));
        }
        match text.split_once('@') {
            Some((id, version)) => Some(Self::Id { id: id.to_owned(), version: Some(version.parse().ok()?) }),
            None => Some(Self::Id { id: text.to_owned(), version: None }),
        }
    }
}

/// A version of a recipe.
///
/// # Errors
/// If it does not exist or is damaged.
pub async fn stored_version(
    catalogue: &EventedCatalogue,
    id: &str,
    version: i64,
) -> Result<RecipeVersion, AppError> {
    RecipeVersion::of(catalogue.read().recipe_version(id, version).await?)
}

/// The newest version of a recipe.
///
/// # Errors
/// If it does not exist or is damaged.
pub async fn newest_version(
    catalogue: &EventedCatalogue,
    id: &str,
) -> Result<(RecipeRecord, RecipeVersion), AppError> {
    let recipe = catalogue.read().recipe(id).await?;
    let version = stored_version(catalogue, id, recipe.newest).await?;
    Ok((recipe, version))
}

/// The version for inspecting a part: the requested one, else that of the recipe whose `serial_pattern` matches.
///
/// # Errors
/// If no recipe or more than one matches, or it is archived.
pub async fn found(
    catalogue: &EventedCatalogue,
    named: Option<&RecipeRef>,
    serial: &str,
) -> Result<RecipeVersion, AppError> {
    match named {
        None => by_rule(catalogue, serial).await,
        Some(RecipeRef::Number(number)) => {
            let filter = RecipeFilter { archived: Some(false), number: Some(*number) };
            let recipe = catalogue.read().recipes(&filter, &Page { before: None, limit: 1 }).await?.whole()?.pop();
            let recipe = recipe.ok_or_else(|| {
                let detail = format!("no recipe in use has the number {number}");
                refused("/recipe", detail, "give the number or the id of a recipe")
            })?;
            stored_version(catalogue, &recipe.id, recipe.newest).await
        }
        Some(RecipeRef::Id { id, version }) => {
            let recipe = existing(catalogue.read().recipe(id).await)?;
            if recipe.archived {
                let detail = format!("recipe {id} is archived");
                return Err(AppError::new(ErrorKind::Conflict, detail).at("/recipe").remedy("restore it first"));
            }
            existing(catalogue.read().recipe_version(id, version.unwrap_or(recipe.newest)).await)
                .and_then(RecipeVersion::of)
        }
    }
}

/// The request itself is valid, hence 422 and not 404.
fn existing<T>(read: Result<T, store::StoreError>) -> Result<T, AppError> {
    match read {
        Err(error @ store::StoreError::NotFound { .. }) => {
            Err(refused("/recipe", error.to_string(), "give the id of a recipe, or id@version"))
        }
        read => read.map_err(AppError::from),
    }
}

async fn by_rule(catalogue: &EventedCatalogue, serial: &str) -> Result<RecipeVersion, AppError> {
    let in_use = RecipeFilter { archived: Some(false), number: None };
    let all = Page { before: None, limit: u32::MAX };
    let mut matching = Vec::new();
    for recipe in catalogue.read().recipes(&in_use, &all).await?.whole()? {
        let version = stored_version(catalogue, &recipe.id, recipe.newest).await?;
        let Some(pattern) = &version.recipe.serial_pattern else { continue };
        if SerialRule::new(pattern)?.matches(serial) {
            matching.push(version);
        }
    }
    if matching.len() > 1 {
        let ids: Vec<&str> = matching.iter().map(|version| version.id.as_str()).collect();
        let detail =
            format!("the serial_pattern of several recipes matches this serial number: {}", ids.join(", "));
        return Err(refused("/recipe", detail, "give the recipe, or make the patterns mutually exclusive"));
    }
    matching.pop().ok_or_else(|| {
        let detail = "no recipe is given, and no serial_pattern matches this serial number";
        refused("/recipe", detail, "give the recipe, or add a serial_pattern to it")
    })
}
