//! Recipes: how a part is scanned, what is measured, and the limits; in immutable versions.

mod allowed;
mod changes;
pub(crate) mod check;
mod file;
mod find;
mod recipe;
mod serial_rule;
mod version;

pub use allowed::AllowedRecipes;
pub use changes::{PlaceChange, changes_between};
pub use file::{ModelFile, RecipeFile, RecipeFileError, RecipeFileModel, RecipeFormat};
pub use find::{RecipeRef, found, newest_version, stored_version};
pub use recipe::Recipe;
pub use version::RecipeVersion;

#[cfg(test)]
pub(crate) mod tests;
