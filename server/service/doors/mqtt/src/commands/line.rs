//! What the commands act on: the service, or a script in tests.

use app::App;
use app::doors::{Change, IdempotencyRecord, now_ms};
use app::error::{AppError, ErrorKind};
use app::principal::Principal;
use app::recipes::AllowedRecipes;
use app::{hash_hex, use_cases};
use async_trait::async_trait;
use serde_json::json;

use crate::commands::command::Inspect;

/// An inspection that was requested.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Started {
    /// Its job.
    pub job_id: String,
    /// By an earlier message with the same id.
    pub is_repeated: bool,
}

/// What clients can command; `id` is that of the command.
#[async_trait]
pub trait Line: Send + Sync + 'static {
    /// Requests an inspection, once per id.
    async fn inspect(&self, id: &str, inspect: &Inspect) -> Result<Started, AppError>;

    /// Cancels the inspection that the command `command_id` started.
    async fn abort(&self, id: &str, command_id: &str) -> Result<(), AppError>;

    /// Stops the station.
    async fn stop(&self, id: &str) -> Result<(), AppError>;
}

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

    fn principal(&self, id: &str) -> Principal {
        Principal::local(&self.door, &format!("MQTT command {id}"), None)
    }

    fn key(&self, id: &str) -> String {
        format!("mqtt {} {id}", self.door)
    }

    async fn stored(&self, id: &str) -> Result<Option<IdempotencyRecord>, AppError> {
        Ok(self.app.catalogue.read().idempotency(&self.key(id)).await?)
    }
}

#[async_trait]
impl Line for AppLine {
    async fn inspect(&self, id: &str, inspect: &Inspect) -> Result<Started, AppError> {
        let body_sha256 = hash_hex(inspect.identity.as_bytes());
        if let Some(earlier) = self.stored(id).await? {
            if earlier.body_sha256 != body_sha256 {
                return Err(AppError::new(ErrorKind::Conflict, "the id was used for another inspection")
                    .remedy("use a new id for a new inspection")
                    .at("/id"));
            }
            let job_id = earlier.answer["job_id"].as_str().unwrap_or_default().to_owned();
            return Ok(Started { job_id, is_repeated: true });
        }
        let recipe =
            self.recipes.found(&self.app.catalogue, inspect.recipe.as_ref(), &inspect.part.serial).await?;
        let (app, by, part, key) = (self.app.clone(), self.principal(id), inspect.part.clone(), self.key(id));
        // Runs to completion when the door is closed meanwhile.
        let started = self.app.tasks.spawn(async move {
            use_cases::inspect(&app, &by, Some(recipe), part, |job| {
                let answer = json!({ "job_id": job.id });
                vec![Change::InsertIdempotency(IdempotencyRecord {
                    key,
                    body_sha256,
                    answer,
                    created_at_ms: now_ms(),
                })]
            })
            .await
        });
        let job = started.await.unwrap_or_else(|cause| {
            Err(AppError::new(ErrorKind::Internal, "the inspection could not be started")
                .because(cause.to_string()))
        })?;
        Ok(Started { job_id: job.id, is_repeated: false })
    }

    async fn abort(&self, id: &str, command_id: &str) -> Result<(), AppError> {
        let started = self.stored(command_id).await?.ok_or_else(|| {
            AppError::new(ErrorKind::NotFound, format!("no inspection was started by the command {command_id}"))
                .remedy("give the id of the command that started the inspection")
                .at("/command_id")
        })?;
        let job_id = started.answer["job_id"].as_str().unwrap_or_default();
        use_cases::cancel_job(&self.app, &self.principal(id), job_id).await.map(drop)
    }

    async fn stop(&self, id: &str) -> Result<(), AppError> {
        let outcome = use_cases::stop(&self.app, &self.principal(id)).await;
        outcome.acknowledged.map_err(AppError::from)
    }
}

#[cfg(test)]
mod tests {
    use app::config::AppConfig;
    use app::inspections::InspectedPart;

    use super::*;

    fn inspect(serial: &str) -> Inspect {
        let part = InspectedPart { serial: serial.to_owned(), order: None, attributes: Default::default() };
        Inspect { recipe: None, part, identity: serial.to_owned() }
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn an_id_stands_for_one_inspection_and_a_refused_command_leaves_it_free() {
        let folder = tempfile::tempdir().unwrap();
        let app = App::start(AppConfig::simulated(folder.path().join("data")), Vec::new()).await.unwrap();
        let line = AppLine::new(app.clone(), "mes", &[]);
        let refused = line.inspect("c-1", &inspect("S1")).await.unwrap_err();
        assert!(refused.remedy.is_some() && line.stored("c-1").await.unwrap().is_none(), "{refused:?}");

        let record = IdempotencyRecord {
            key: line.key("c-1"),
            body_sha256: hash_hex(inspect("S1").identity.as_bytes()),
            answer: json!({ "job_id": "job-7" }),
            created_at_ms: now_ms(),
        };
        app.catalogue.commit(vec![Change::InsertIdempotency(record)]).await.unwrap();
        let repeated = line.inspect("c-1", &inspect("S1")).await.unwrap();
        assert_eq!(repeated, Started { job_id: "job-7".to_owned(), is_repeated: true });
        let other = line.inspect("c-1", &inspect("S2")).await.unwrap_err();
        assert_eq!((other.kind, other.pointer.as_deref()), (ErrorKind::Conflict, Some("/id")));
        // Another door has ids of its own.
        let elsewhere = AppLine::new(app.clone(), "erp", &[]);
        assert!(elsewhere.stored("c-1").await.unwrap().is_none());

        let unknown = line.abort("c-2", "c-0").await.unwrap_err();
        assert_eq!(unknown.pointer.as_deref(), Some("/command_id"));
        // The job of the command is asked for, and the store does not know this one.
        assert_eq!(line.abort("c-3", "c-1").await.unwrap_err().kind, ErrorKind::NotFound);
        line.stop("c-4").await.unwrap();
        assert!(app.station.is_halted());
        app.shut_down().await;
    }
}
