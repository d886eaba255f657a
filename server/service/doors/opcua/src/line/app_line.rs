//! Methods as use cases of the service.

use app::App;
use app::doors::{InspectionFilter, InspectionMessage, Page, RecipeFilter};
use app::error::{AppError, ErrorKind};
use app::inspections::InspectedPart;
use app::principal::Principal;
use app::recipes::{AllowedRecipes, RecipeRef, stored_version};
use app::use_cases::{self, TakeControl};
use async_trait::async_trait;

use crate::line::{Finished, Line, Recipe, ResultFilter, StartJob};
use crate::refusal::Refusal;

/// Number of inspections read at a time.
const AT_A_TIME: u32 = 100;

/// The service.
pub struct AppLine {
    app: App,
    /// Name of the door, in whose name everything is done.
    door: String,
    recipes: AllowedRecipes,
}

impl AppLine {
    /// For the door of this name.
    pub fn new(app: App, door: &str, recipes: &[String]) -> Self {
        Self { app, door: door.to_owned(), recipes: AllowedRecipes::new(recipes) }
    }

    fn principal(&self, user: &str) -> Principal {
        Principal::local(&self.door, &format!("OPC UA user {user}"), None)
    }

    /// The version for an inspection.
    async fn recipe(&self, named: Option<&str>, serial: &str) -> Result<RecipeRef, Refusal> {
        let named = match named.map(RecipeRef::parse) {
            Some(None) => return Err(Refusal::NoRecipe),
            named => named.flatten(),
        };
        self.recipes.found(&self.app.catalogue, named.as_ref(), serial).await.map_err(|error| Refusal::of(&error))
    }

    async fn reset_in_control(&self, user: &str) -> Result<(), AppError> {
        let holder = TakeControl { holder: self.door.clone(), take_over: false };
        let lease = use_cases::take_control(&self.app, &self.principal(user), holder).await?;
        let by = Principal { control_id: Some(lease.id.clone()), ..self.principal(user) };
        let outcome = use_cases::reset(&self.app, &by).await;
        use_cases::release_control(&self.app, &by).await?;
        outcome
    }

    async fn list_recipes(&self) -> Result<Vec<Recipe>, AppError> {
        let in_use = RecipeFilter { archived: Some(false), number: None };
        let all = Page { before: None, limit: u32::MAX };
        let mut recipes = Vec::new();
        for record in self.app.catalogue.read().recipes(&in_use, &all).await?.records {
            if self.recipes.contains(&record.id) {
                let version = stored_version(&self.app.catalogue, &record.id, record.newest).await?;
                recipes.push(Recipe { id: version.id, version: version.version, digest: version.digest });
            }
        }
        recipes.sort_by(|a, b| a.id.cmp(&b.id));
        Ok(recipes)
    }

    /// The result with this id; `None` for one of a recipe that this door does not use.
    async fn find(&self, id: &str) -> Result<Option<Finished>, AppError> {
        let record = self.app.catalogue.read().inspection(id).await?;
        let job_id = record.job_id.clone();
        let inspection = InspectionMessage::try_from(record)?;
        Ok(self.recipes.contains(&inspection.recipe.id).then_some(Finished { inspection, job_id }))
    }

    async fn list(
        &self,
        filter: &ResultFilter,
        skip: usize,
        limit: usize,
    ) -> Result<(Vec<Finished>, bool), AppError> {
        let stored = InspectionFilter {
            serial: filter.serial.clone(),
            recipe_id: filter.recipe.clone(),
            recipe_version: filter.version,
            ..InspectionFilter::default()
        };
        let (mut before, mut n_passed, mut results) = (None, 0, Vec::new());
        loop {
            let page = Page { before: before.take(), limit: AT_A_TIME };
            let listed = self.app.catalogue.read().inspections(&stored, &page).await?;
            for record in listed.records {
                let is_of_job = filter.job_id.is_none() || record.job_id == filter.job_id;
                if !is_of_job || !self.recipes.contains(&record.recipe_id) {
                    continue;
                }
                n_passed += 1;
                if n_passed <= skip {
                    continue;
                }
                if results.len() == limit {
                    return Ok((results, false));
                }
                let job_id = record.job_id.clone();
                results.push(Finished { inspection: record.try_into()?, job_id });
            }
            before = listed.next;
            if before.is_none() {
                return Ok((results, true));
            }
        }
    }
}

#[async_trait]
impl Line for AppLine {
    async fn start(&self, user: &str, job: StartJob) -> Result<String, Refusal> {
        let recipe = self.recipe(job.recipe.as_deref(), &job.serial).await?;
        let attributes = job.attributes.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        let part = InspectedPart { serial: job.serial, order: None, attributes };
        let by = self.principal(user);
        let job = use_cases::inspect(&self.app, &by, Some(recipe), part, |_| Vec::new()).await;
        job.map(|job| job.id).map_err(|error| Refusal::of(&error))
    }

    async fn abort(&self, user: &str, job_id: &str) -> Result<(), Refusal> {
        match use_cases::cancel_job(&self.app, &self.principal(user), job_id).await {
            Ok(_) => Ok(()),
            Err(error) if error.kind == ErrorKind::NotFound => Err(Refusal::NotReady),
            Err(error) => Err(Refusal::of(&error)),
        }
    }

    async fn halt(&self, user: &str) -> Result<(), Refusal> {
        use_cases::stop(&self.app, &self.principal(user)).await.acknowledged.map_err(|_| Refusal::Fault)
    }

    async fn reset(&self, user: &str) -> Result<(), Refusal> {
        self.reset_in_control(user).await.map_err(|error| Refusal::of(&error))
    }

    fn newest_change(&self) -> u64 {
        self.app.station.status().state_history.newest()
    }

    async fn recipes(&self) -> Result<Vec<Recipe>, Refusal> {
        self.list_recipes().await.map_err(|error| Refusal::of(&error))
    }

    async fn result(&self, id: &str) -> Result<Finished, Refusal> {
        self.find(id).await.map_err(|error| Refusal::of(&error))?.ok_or(Refusal::NoResult)
    }

    async fn results(
        &self,
        filter: &ResultFilter,
        skip: usize,
        limit: usize,
    ) -> Result<(Vec<Finished>, bool), Refusal> {
        self.list(filter, skip, limit).await.map_err(|error| Refusal::of(&error))
    }
}
