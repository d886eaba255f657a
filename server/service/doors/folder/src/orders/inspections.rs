//! What the orders need of the service: start an inspection, exactly once per key.

use app::App;
use app::doors::{Change, IdempotencyRecord, now_ms};
use app::error::{AppError, ErrorKind};
use app::principal::Principal;
use app::{hash_hex, use_cases};
use async_trait::async_trait;
use serde_json::json;

use crate::orders::order::Order;

/// Inspections that are started exactly once per key.
#[async_trait]
pub trait Inspections: Send + Sync + 'static {
    /// Whether an inspection was started with this key, also before a crash.
    async fn is_started(&self, key: &str) -> Result<bool, AppError>;

    /// Starts an inspection; its key is stored in the same transaction.
    async fn start(&self, file: &str, order: &Order, key: &str) -> Result<(), AppError>;

    /// Releases a key: the same order may be given again.
    async fn release(&self, key: &str) -> Result<(), AppError>;
}

/// The key of the `n`-th order with this content in a file. It does not depend on other rows, so that a table may be
/// corrected while some of its rows wait.
pub fn key(door: &str, file: &str, order: &Order, n: usize) -> String {
    format!("folder {door} {file} {} {n}", hash_hex(order.identity.as_bytes()))
}

/// Whether an order waits instead of being refused: what is wrong is the state of the station, not the order.
pub fn is_temporary(kind: ErrorKind) -> bool {
    match kind {
        ErrorKind::Halted
        | ErrorKind::StationBusy
        | ErrorKind::ControlRequired
        | ErrorKind::ControlExpired
        | ErrorKind::TooMany
        | ErrorKind::Internal
        | ErrorKind::DeviceFault
        | ErrorKind::Unavailable
        | ErrorKind::StorageFull
        | ErrorKind::Stopped => true,
        ErrorKind::BadRequest
        | ErrorKind::NotFound
        | ErrorKind::Conflict
        | ErrorKind::Changed
        | ErrorKind::TooLarge
        | ErrorKind::Impossible
        | ErrorKind::Damaged => false,
    }
}

/// The inspections of the running service.
pub struct AppInspections {
    app: App,
    door: String,
}

impl AppInspections {
    /// Started on behalf of this door.
    pub fn new(app: App, door: &str) -> Self {
        Self { app, door: door.to_owned() }
    }
}

#[async_trait]
impl Inspections for AppInspections {
    async fn is_started(&self, key: &str) -> Result<bool, AppError> {
        Ok(self.app.catalogue.read().idempotency(key).await?.is_some())
    }

    async fn start(&self, file: &str, order: &Order, key: &str) -> Result<(), AppError> {
        let stored = Change::InsertIdempotency(stored(file, order, key));
        let by = Principal::local(&self.door, file, None);
        let (app, recipe, part) = (self.app.clone(), order.recipe.clone(), order.part.clone());
        // Runs to completion when the door is closed meanwhile.
        let inspect =
            async move { use_cases::inspect(&app, &by, recipe, part, |_| vec![stored]).await.map(|_| ()) };
        self.app.tasks.spawn(inspect).await.unwrap_or_else(|cause| {
            Err(AppError::new(ErrorKind::Internal, "an inspection could not be started")
                .because(cause.to_string()))
        })
    }

    async fn release(&self, key: &str) -> Result<(), AppError> {
        let released = Change::AnswerIdempotency { key: key.to_owned(), answer: None };
        self.app.catalogue.commit(vec![released]).await?;
        Ok(())
    }
}

/// The record of a key.
fn stored(file: &str, order: &Order, key: &str) -> IdempotencyRecord {
    IdempotencyRecord {
        key: key.to_owned(),
        body_sha256: hash_hex(order.identity.as_bytes()),
        answer: json!({ "file": file, "row": order.row }),
        created_at_ms: now_ms(),
    }
}

#[cfg(test)]
mod tests {
    use app::config::AppConfig;

    use super::*;
    use crate::orders::order::{OrderFormat, orders};

    async fn inspections(folder: &tempfile::TempDir) -> AppInspections {
        let app = App::start(AppConfig::simulated(folder.path().join("data")), Vec::new()).await.unwrap();
        AppInspections::new(app, "mes")
    }

    fn order(text: &str) -> Order {
        orders(OrderFormat::Json, text.as_bytes()).unwrap().remove(0)
    }

    /// The work of one process: everything ends with it.
    fn process<T>(work: impl Future<Output = T>) -> T {
        tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap().block_on(work)
    }

    #[test]
    fn a_stored_key_is_found_after_a_restart_until_it_is_freed() {
        let (folder, order) = (tempfile::tempdir().unwrap(), order(r#"{"serial":"S1"}"#));
        let key = key("mes", "a.json", &order, 1);
        process(async {
            let inspections = inspections(&folder).await;
            assert!(!inspections.is_started(&key).await.unwrap());
            let store = || {
                inspections.app.catalogue.commit(vec![Change::InsertIdempotency(stored("a.json", &order, &key))])
            };
            store().await.unwrap();
            // The same key again would be an inspection started twice.
            store().await.unwrap_err();
            inspections.app.shut_down().await;
        });
        process(async {
            let inspections = inspections(&folder).await;
            assert!(inspections.is_started(&key).await.unwrap());
            inspections.release(&key).await.unwrap();
            assert!(!inspections.is_started(&key).await.unwrap());
            inspections.app.shut_down().await;
        });
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn an_order_without_a_recipe_for_it_is_refused_and_its_key_is_not_stored() {
        let (folder, order) = (tempfile::tempdir().unwrap(), order(r#"{"serial":"S1"}"#));
        let (inspections, key) = (inspections(&folder).await, key("mes", "a.json", &order, 1));
        let refused = inspections.start("a.json", &order, &key).await.unwrap_err();
        assert!(!is_temporary(refused.kind) && refused.remedy.is_some(), "{refused:?}");
        assert!(!inspections.is_started(&key).await.unwrap());
        inspections.app.shut_down().await;
    }

    #[test]
    fn equal_orders_have_equal_keys_only_in_the_same_place() {
        let (one, other) = (order(r#"{"serial":"S1"}"#), order(r#"{"serial":"S2"}"#));
        let same = key("mes", "a.json", &one, 1);
        assert_eq!(same, key("mes", "a.json", &order(r#"{ "serial": "S1" }"#), 1));
        for another in [
            key("erp", "a.json", &one, 1),
            key("mes", "b.json", &one, 1),
            key("mes", "a.json", &other, 1),
            key("mes", "a.json", &one, 2),
        ] {
            assert_ne!(same, another);
        }
    }
}
