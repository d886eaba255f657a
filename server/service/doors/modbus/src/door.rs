//! The door: shows each result until the PLC acknowledges it.

use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use app::App;
use app::doors::{BadSetting, Delivery, Door, EventFilter, EventRecord, Undelivered};
use async_trait::async_trait;

use crate::handshake::results::Offer;
use crate::line::{AppLine, count_results};
use crate::registers::result_block::ResultBlock;
use crate::server::params::IDLE;
use crate::server::{Limits, Shared, serve};
use crate::settings::Settings;

/// See [`ModbusDoor::patience`].
const PATIENCE: Duration = Duration::from_secs(60);

/// A test succeeds if there was a request within this time: a PLC polls more often.
const REACHABLE_WITHIN: Duration = Duration::from_secs(10);

/// Time after which a delivery looks again, also without a request.
const LOOK_AGAIN: Duration = Duration::from_millis(250);

/// Most connections that can be configured.
const MOST_CONNECTIONS: usize = 64;

/// The event that announces a result.
const INSPECTION_FINISHED: &str = "inspection.finished";

/// A Modbus TCP server for PLCs.
pub struct ModbusDoor {
    settings: Settings,
    filter: EventFilter,
    /// After so long without a request, a result is reported as waiting; it stays shown.
    pub patience: Duration,
    /// What it shares with its server.
    pub shared: Arc<Shared>,
}

impl ModbusDoor {
    /// Not listening yet.
    ///
    /// # Errors
    /// A setting cannot be used.
    pub fn new(settings: Settings) -> Result<Self, BadSetting> {
        if settings.name.trim().is_empty() {
            return Err(BadSetting { setting: "name", why: "it is empty; give the door a name".to_owned() });
        }
        if !(1..=MOST_CONNECTIONS).contains(&settings.max_connections) {
            let why = format!("{} connections are not possible; give 1 to 64", settings.max_connections);
            return Err(BadSetting { setting: "max_connections", why });
        }
        let filter = EventFilter::new(vec![INSPECTION_FINISHED.to_owned()], settings.recipes.clone())?;
        let shared = Shared::new(settings.writes);
        Ok(Self { settings, filter, patience: PATIENCE, shared })
    }

    /// Shows a result until it is acknowledged. Without writes, the newest result is shown and that is all.
    async fn show(&self, event_seq: i64, block: &ResultBlock) -> Result<(), Undelivered> {
        if !self.settings.writes {
            self.shared.handshake.lock().results.replace(event_seq, block);
            return Ok(());
        }
        let begun = Instant::now();
        let mut requests = self.shared.requests.subscribe();
        loop {
            requests.borrow_and_update();
            let now = Instant::now();
            if self.shared.handshake.lock().results.offer(event_seq, block, now) == Offer::Acknowledged {
                return Ok(());
            }
            if let Some(reason) = self.shared.not_listening() {
                return Err(Undelivered::unreachable(reason));
            }
            let (last, _) = self.shared.last_contact();
            if now.duration_since(last.max(begun)) >= self.patience {
                let seconds = self.patience.as_secs();
                let reason = format!("no PLC has sent a request for {seconds} s; the result waits for one");
                return Err(Undelivered::unreachable(reason));
            }
            // After either, it looks again.
            let _ = tokio::time::timeout(LOOK_AGAIN, requests.changed()).await;
        }
    }

    /// A test shows nothing: a PLC would take it for a part.
    fn test(&self) -> Result<(), Undelivered> {
        if let Some(reason) = self.shared.not_listening() {
            return Err(Undelivered::unreachable(reason));
        }
        match self.shared.last_contact() {
            (last, true) if last.elapsed() <= REACHABLE_WITHIN => Ok(()),
            _ => Err(Undelivered::unreachable("no PLC has sent a request for 10 s")),
        }
    }
}

#[async_trait]
impl Door for ModbusDoor {
    fn name(&self) -> &str {
        &self.settings.name
    }

    fn kind(&self) -> &'static str {
        "modbus"
    }

    fn target(&self) -> String {
        format!("PLCs at {}", self.settings.listen)
    }

    fn register_map(&self) -> Option<&'static str> {
        static MAP: LazyLock<String> = LazyLock::new(crate::csv);
        Some(&MAP)
    }

    /// A re-evaluation is not wanted: the PLC would take it for the part before it.
    fn wants(&self, event: &EventRecord) -> bool {
        self.filter.matches(event) && event.body["re_evaluated_from"].is_null()
    }

    async fn deliver(&self, delivery: &Delivery) -> Result<(), Undelivered> {
        match &delivery.inspection {
            Some(inspection) => self.show(delivery.event.seq, &ResultBlock::of(inspection)).await,
            None => self.test(),
        }
    }

    async fn serve(self: Arc<Self>, app: App) {
        let Settings { name, listen, max_connections, recipes, .. } = &self.settings;
        let limits = Limits { max_connections: *max_connections, idle: IDLE };
        let line = Arc::new(AppLine::new(app.clone(), name, recipes));
        let note = |event_seq| self.shared.handshake.lock().results.note(event_seq);
        let counting = async {
            count_results(&app, name, |event| self.wants(event), note).await;
            std::future::pending().await
        };
        tokio::select! {
            () = app.closing.cancelled() => {}
            () = serve(self.shared.clone(), line, *listen, limits) => {}
            () = counting => {}
        }
    }
}
