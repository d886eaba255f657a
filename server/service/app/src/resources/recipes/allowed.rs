//! The recipes that a door may use.

use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::resources::recipes::{RecipeRef, found};

/// The recipes that a door may use: those named in its settings, or all if none is named.
#[derive(Debug, Clone, Default)]
pub struct AllowedRecipes(Vec<String>);

impl AllowedRecipes {
    /// Those with these ids; all if there are none.
    pub fn new(ids: &[String]) -> Self {
        Self(ids.to_vec())
    }

    /// Whether the recipe with this id may be used.
    pub fn contains(&self, id: &str) -> bool {
        self.0.is_empty() || self.0.iter().any(|allowed| allowed == id)
    }

    /// The version for inspecting a part, with its number.
    ///
    /// # Errors
    /// As [`found`], and if the recipe may not be used.
    pub async fn found(
        &self,
        catalogue: &EventedCatalogue,
        named: Option<&RecipeRef>,
        serial: &str,
    ) -> Result<RecipeRef, AppError> {
        let version = found(catalogue, named, serial).await?;
        if !self.contains(&version.id) {
            return Err(AppError::new(ErrorKind::Impossible, format!("this door does not use {}", version.id))
                .remedy("add the recipe to the setting recipes of the door")
                .at("/recipe"));
        }
        Ok(RecipeRef::Id { id: version.id, version: Some(version.version) })
    }
}
