//! Commands of a PLC as use cases of the service.

use std::collections::BTreeMap;
use std::time::Duration;

use app::App;
use app::doors::EventRecord;
use app::error::{AppError, ErrorKind};
use app::inspections::InspectedPart;
use app::principal::Principal;
use app::recipes::{AllowedRecipes, RecipeRef};
use app::use_cases;
use async_trait::async_trait;

use crate::codes::AckCode;
use crate::line::{JobEnd, Line, Station, TriggeredPart};

/// Time until the store is asked again.
const RETRY: Duration = Duration::from_secs(1);

/// Time after which the end of a job is asked for even without news of it.
const ASK_AGAIN: Duration = Duration::from_secs(60);

/// Number of events read from the log at a time.
const EVENTS_AT_A_TIME: u32 = 1000;

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

    fn principal(&self, source: &str) -> Principal {
        Principal::local(&self.door, source, None)
    }

    /// The version for inspecting a part.
    async fn recipe(&self, number: Option<u32>, serial: &str) -> Result<RecipeRef, AckCode> {
        let number = number.map(|number| RecipeRef::Number(number.into()));
        self.recipes.found(&self.app.catalogue, number.as_ref(), serial).await.map_err(|error| code(&error))
    }
}

#[async_trait]
impl Line for AppLine {
    fn station(&self) -> Station {
        let status = self.app.station.status();
        Station {
            state: status.state,
            stopped: self.app.station.is_halted(),
            simulated: status.simulated.is_some(),
        }
    }

    async fn trigger(&self, source: &str, part: &TriggeredPart) -> Result<String, AckCode> {
        let recipe = self.recipe(part.recipe, &part.serial).await?;
        let TriggeredPart { serial, order, .. } = part.clone();
        let part = InspectedPart { serial, order, attributes: BTreeMap::new() };
        let by = self.principal(source);
        let job = use_cases::inspect(&self.app, &by, Some(recipe), part, |_| Vec::new()).await;
        job.map(|job| job.id).map_err(|error| code(&error))
    }

    async fn ended(&self, job_id: &str) -> JobEnd {
        loop {
            match use_cases::wait_for_job(&self.app, job_id, ASK_AGAIN).await {
                Ok(view) if !view.record.state.is_terminal() => {}
                Ok(view) if view.record.result.as_ref().is_some_and(|result| result.kind == "inspection") => {
                    return JobEnd::Finished;
                }
                Ok(view) if view.record.problem.is_none() => return JobEnd::Cancelled,
                Ok(_) => return JobEnd::Failed,
                Err(error) if error.kind == ErrorKind::NotFound => return JobEnd::Failed,
                Err(error) => {
                    tracing::warn!(door = self.door, job = job_id, error = error.detail, "its end is unknown");
                    tokio::time::sleep(RETRY).await;
                }
            }
        }
    }

    async fn abort(&self, source: &str, job_id: &str) -> Result<(), AckCode> {
        let cancelled = use_cases::cancel_job(&self.app, &self.principal(source), job_id).await;
        cancelled.map(drop).map_err(|error| code(&error))
    }

    async fn stop(&self, source: &str) -> Result<(), AckCode> {
        let outcome = use_cases::stop(&self.app, &self.principal(source)).await;
        outcome.acknowledged.map_err(|_| AckCode::Fault)
    }

    async fn prepare(&self, recipe: u32) -> Result<(), AckCode> {
        self.recipe(Some(recipe), "").await.map(drop)
    }
}

/// The code of a refusal; what a PLC cannot act on is in the log.
fn code(error: &AppError) -> AckCode {
    let code = match (error.kind, error.pointer.as_deref()) {
        (_, Some("/serial" | "/order")) => AckCode::BadSerial,
        (_, Some(pointer)) if pointer.starts_with("/recipe") => AckCode::NoRecipe,
        (ErrorKind::ControlRequired | ErrorKind::ControlExpired, _) => AckCode::NotInControl,
        (ErrorKind::Halted | ErrorKind::Stopped, _) => AckCode::Stopped,
        (ErrorKind::StationBusy, _) => AckCode::Busy,
        (ErrorKind::TooMany, _) => AckCode::QueueFull,
        (ErrorKind::DeviceFault, _) => AckCode::Fault,
        (ErrorKind::Conflict | ErrorKind::Impossible, _) => AckCode::NotReady,
        _ => AckCode::Unavailable,
    };
    tracing::info!(code = code.number(), error = error.detail, cause = error.cause, "a command was refused");
    code
}

/// Passes every result that the door will deliver to `note`, from its stored position on.
pub async fn count_results(app: &App, door: &str, is_result: impl Fn(&EventRecord) -> bool, note: impl Fn(i64)) {
    let mut newest = app.catalogue.watch_events();
    let mut seq = loop {
        match app.doors.get(door).await {
            Ok(view) if view.record.is_some() => break view.record.map_or(0, |record| record.seq),
            Ok(_) | Err(_) => tokio::time::sleep(RETRY).await,
        }
    };
    loop {
        newest.borrow_and_update();
        loop {
            let Ok(listed) = app.catalogue.read().events_after(seq, EVENTS_AT_A_TIME).await else {
                tokio::time::sleep(RETRY).await;
                continue;
            };
            listed.records.iter().filter(|event| is_result(event)).for_each(|event| note(event.seq));
            match listed.records.last() {
                Some(last) => seq = last.seq,
                None => break,
            }
        }
        if newest.changed().await.is_err() {
            return;
        }
    }
}
