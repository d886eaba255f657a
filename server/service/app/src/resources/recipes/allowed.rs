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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::App;
    use crate::access::principal::Principal;
    use crate::config::AppConfig;
    use crate::resources::recipes::tests::ball;
    use crate::use_cases::{NewVersion, publish_recipe};

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_recipe_that_the_settings_do_not_name_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let app = App::start(AppConfig::simulated(folder.path().join("data")), Vec::new()).await.unwrap();
        let first =
            NewVersion { id: "ball".to_owned(), after: 0, reason: "first".to_owned(), recipe: ball(18.9, 0.05) };
        publish_recipe(&app, &Principal::local("rest", "test", None), first, |_| Vec::new()).await.unwrap();
        let named = RecipeRef::parse("ball");
        let found_among = async |ids: &[&str]| {
            let ids: Vec<String> = ids.iter().map(|id| (*id).to_owned()).collect();
            AllowedRecipes::new(&ids).found(&app.catalogue, named.as_ref(), "S").await
        };
        let newest = RecipeRef::Id { id: "ball".to_owned(), version: Some(1) };
        assert_eq!(found_among(&[]).await.unwrap(), newest);
        assert_eq!(found_among(&["bracket", "ball"]).await.unwrap(), newest);
        let refusal = found_among(&["bracket"]).await.unwrap_err();
        assert_eq!((refusal.kind, refusal.pointer.as_deref()), (ErrorKind::Impossible, Some("/recipe")));
        assert!(refusal.remedy.is_some(), "{refusal:?}");
        app.shut_down().await;
    }
}
