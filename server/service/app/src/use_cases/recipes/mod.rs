//! Recipes: publish, restore a version, archive, import; the CAD models that they name.

mod models;

pub use models::{add_model, delete_model};

use models::models_of_file;

use station::wall_clock::now_ms;
use store::{Change, StoreError};

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::events::{Event, RecipePublished, event};
use crate::resources::labels::label;
use crate::resources::models::hold_models;
use crate::resources::recipes::check::check_id;
use crate::resources::recipes::{Recipe, RecipeFile, RecipeVersion, newest_version, stored_version};

/// A version to publish.
#[derive(Debug, Clone, PartialEq)]
pub struct NewVersion {
    /// The recipe.
    pub id: String,
    /// The current newest version; 0: none.
    pub after: i64,
    /// Why.
    pub reason: String,
    /// The content.
    pub recipe: Recipe,
}

/// Publishes a version of a recipe, together with what `and` returns.
///
/// # Errors
/// The recipe is invalid, its number is taken, another version was published meanwhile, or the recipe is archived.
pub async fn publish_recipe(
    app: &App,
    by: &Principal,
    new: NewVersion,
    and: impl FnOnce(&RecipeVersion) -> Vec<Change>,
) -> Result<RecipeVersion, AppError> {
    store_version(app, by, new, None, and).await
}

/// Publishes a version with the content of an earlier one.
///
/// # Errors
/// As [`publish_recipe`], or the version does not exist.
pub async fn roll_back_recipe(
    app: &App,
    by: &Principal,
    (id, after): (&str, i64),
    (to_version, reason): (i64, String),
    and: impl FnOnce(&RecipeVersion) -> Vec<Change>,
) -> Result<RecipeVersion, AppError> {
    let earlier = stored_version(&app.catalogue, id, to_version).await.map_err(|problem| match problem.kind {
        ErrorKind::NotFound => AppError { kind: ErrorKind::Impossible, ..problem }
            .at("/to_version")
            .remedy("give one of its versions"),
        _ => problem,
    })?;
    let new = NewVersion { id: id.to_owned(), after, reason, recipe: earlier.recipe };
    store_version(app, by, new, Some(to_version), and).await
}

/// Imports a file with its models: creates the recipe, or its next version. `after` is the newest version known; 0: none.
/// If the newest version has the same content, nothing changes.
///
/// # Errors
/// As [`publish_recipe`], or a model is damaged.
pub async fn import_recipe(
    app: &App,
    by: &Principal,
    file: RecipeFile,
    after: i64,
    and: impl FnOnce(&RecipeVersion) -> Vec<Change>,
) -> Result<RecipeVersion, AppError> {
    file.check()?;
    if after > 0 {
        let (_, newest) = newest_version(&app.catalogue, &file.id).await?;
        if newest.digest == file.recipe.digest() {
            app.catalogue.commit(and(&newest)).await?;
            return Ok(newest);
        }
    }
    let reason = format!("imported: version {} {}", file.version, file.reason);
    let reason: String = reason.trim().chars().take(100).collect();
    let mut models = models_of_file(app, by, &file).await?;
    let and = |version: &RecipeVersion| {
        models.extend(and(version));
        models
    };
    publish_recipe(app, by, NewVersion { id: file.id, after, reason, recipe: file.recipe }, and).await
}

async fn store_version(
    app: &App,
    by: &Principal,
    new: NewVersion,
    restored_from: Option<i64>,
    and: impl FnOnce(&RecipeVersion) -> Vec<Change>,
) -> Result<RecipeVersion, AppError> {
    let NewVersion { id, after, reason, recipe } = new;
    check_id(&id)?;
    label(&reason, "/reason")?;
    recipe.check()?;
    hold_models(&*app.artifacts, &recipe.plan, "/recipe/plan").await?;
    let version = RecipeVersion {
        id,
        version: after + 1,
        digest: recipe.digest(),
        author: by.actor.clone(),
        reason,
        restored_from,
        created_at_ms: now_ms(),
        recipe,
    };
    let published = RecipePublished {
        version: version.version,
        digest: version.digest.clone(),
        number: version.recipe.number,
        reason: version.reason.clone(),
        restored_from,
        actor: version.author.clone(),
    };
    let number = version.recipe.number.map(i64::from);
    let mut changes = and(&version);
    changes.push(Change::PublishRecipe { version: version.to_record(), number });
    changes.push(event(&version.id, Event::RecipePublished(published)));
    app.catalogue.commit(changes).await.map_err(|error| match error {
        StoreError::Exists { kind: "recipe", .. } => {
            AppError::from(error).remedy("publish a version of it, or use another id")
        }
        StoreError::Refused { kind: "recipe", .. } => AppError::from(error),
        StoreError::Changed { .. } => AppError::from(error).remedy("read it again, then repeat the change"),
        other => other.into(),
    })?;
    Ok(version)
}

/// Archives a recipe, or restores an archived one.
///
/// # Errors
/// It does not exist, or another recipe in use has its number.
pub async fn archive_recipe(app: &App, by: &Principal, id: &str, archived: bool) -> Result<(), AppError> {
    let done = match archived {
        true => Event::RecipeArchived(by.initiator()),
        false => Event::RecipeRestored(by.initiator()),
    };
    let change = Change::ArchiveRecipe { id: id.to_owned(), archived };
    app.catalogue.commit(vec![change, event(id, done)]).await?;
    Ok(())
}
