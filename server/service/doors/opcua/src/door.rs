//! The door: shows each result to the clients of its server.

use std::sync::Arc;

use app::App;
use app::doors::{BadSetting, Delivery, Door, EventFilter, EventRecord, InspectionMessage, Undelivered};
use app::health;
use async_trait::async_trait;
use tokio::sync::watch;

use crate::line::{AppLine, Condition, Devices, Finished, Line, Unfinished};
use crate::server::users::Users;
use crate::server::{Parts, Shared, serve};
use crate::settings::Settings;

/// The events that announce a result, or that there is none.
const KINDS: [&str; 4] = ["inspection.finished", "job.failed", "job.cancelled", "job.interrupted"];

/// An OPC UA server.
pub struct OpcUaDoor {
    settings: Settings,
    filter: EventFilter,
    users: Arc<Users>,
    shared: Shared,
}

impl OpcUaDoor {
    /// Not listening yet.
    ///
    /// # Errors
    /// A setting cannot be used.
    pub fn new(settings: Settings) -> Result<Self, BadSetting> {
        if settings.name.trim().is_empty() {
            return Err(BadSetting { setting: "name", why: "it is empty; give the door a name".to_owned() });
        }
        if !settings.certificates.is_absolute() {
            let why = format!("\"{}\" is not an absolute path", settings.certificates.display());
            return Err(BadSetting { setting: "certificates", why });
        }
        let users = Arc::new(Users::new(&settings.users, settings.commands, settings.anonymous)?);
        let filter = EventFilter::new(KINDS.map(str::to_owned).to_vec(), settings.recipes.clone())?;
        Ok(Self { settings, filter, users, shared: Shared::new() })
    }

    /// Serves clients until `closing` ends.
    pub async fn run(
        &self,
        line: Arc<dyn Line>,
        condition: watch::Receiver<Condition>,
        closing: impl Future<Output = ()>,
    ) {
        let parts = Parts { settings: self.settings.clone(), users: self.users.clone(), line, condition };
        serve(&self.shared, parts, closing).await;
    }

    /// Shows a result. Nobody acknowledges it: a client that was away asks for the results that it missed.
    async fn show(&self, inspection: &InspectionMessage) -> Result<(), Undelivered> {
        let running = self.shared.running().map_err(Undelivered::unreachable)?;
        let job_id = match running.line.result(&inspection.id).await {
            Ok(stored) => stored.job_id,
            Err(_) => {
                return Err(Undelivered::unreachable(
                    "the result cannot be read from the store; the log states why",
                ));
            }
        };
        running.publisher.publish_result(&Finished { inspection: inspection.clone(), job_id });
        Ok(())
    }
}

#[async_trait]
impl Door for OpcUaDoor {
    fn name(&self) -> &str {
        &self.settings.name
    }

    fn kind(&self) -> &'static str {
        "opcua"
    }

    fn target(&self) -> String {
        format!("clients at opc.tcp://{}", self.settings.listen)
    }

    /// A re-evaluation is not wanted: a client would take it for the part before it. Of the jobs that end without a
    /// result, inspections are.
    fn wants(&self, event: &EventRecord) -> bool {
        let is_part = event.body["re_evaluated_from"].is_null() && event.body["serial"].is_string();
        self.filter.matches(event) && is_part
    }

    async fn deliver(&self, delivery: &Delivery) -> Result<(), Undelivered> {
        if let Some(inspection) = &delivery.inspection {
            return self.show(inspection).await;
        }
        let running = self.shared.running().map_err(Undelivered::unreachable)?;
        // A test shows nothing: a client would take it for a part.
        if let Some(unfinished) = Unfinished::of(&delivery.event) {
            running.publisher.publish_unfinished(&unfinished);
        }
        Ok(())
    }

    async fn serve(self: Arc<Self>, app: App) {
        let condition = watch::Sender::new(Condition::default());
        let watched = condition.subscribe();
        let follow = async {
            health::follow(&app.catalogue, app.station.watch_status(), |status, health| {
                let fault = status.faults.last().map(|fault| format!("{}; {}", fault.detail, fault.remedy));
                let next = Condition {
                    changes: status.state_history.after(0).collect(),
                    job_id: status.job_id.clone(),
                    fault,
                    health: Some(health.clone()),
                    devices: Devices::of(status),
                };
                condition.send_if_modified(|known| {
                    let is_modified = *known != next;
                    *known = next;
                    is_modified
                });
            })
            .await;
            // The station is shut down before the doors: its last state stays.
            std::future::pending::<()>().await;
        };
        let line = Arc::new(AppLine::new(app.clone(), &self.settings.name, &self.settings.recipes));
        tokio::select! {
            () = follow => {}
            () = self.run(line, watched, app.closing.cancelled()) => {}
        }
    }
}
