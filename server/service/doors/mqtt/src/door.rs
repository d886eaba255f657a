//! The door.

use std::sync::Arc;

use app::App;
use app::doors::{BadSetting, Delivery, Door, EventFilter, EventRecord, Undelivered, now_ms};
use async_trait::async_trait;
use tokio::sync::watch;

use crate::commands::{self, AppLine, Line};
use crate::connection::address::Address;
use crate::connection::link::{Link, Message};
use crate::connection::options::options;
use crate::params::{MESSAGE_EXPIRY_S, Times};
use crate::settings::Settings;
use crate::station::presence::report;
use crate::station::topics::Topics;
use crate::station::{Condition, FaultMessage, offline};

/// Publishes events to a broker.
pub struct MqttDoor {
    name: String,
    commands: bool,
    recipes: Vec<String>,
    address: Address,
    topics: Topics,
    filter: EventFilter,
    times: Times,
    link: Link,
}

/// The door of these settings, not yet connected.
///
/// # Errors
/// A setting cannot be used.
pub fn open(settings: Settings) -> Result<Arc<dyn Door>, BadSetting> {
    Ok(Arc::new(MqttDoor::new(settings, Times::default())?))
}

impl MqttDoor {
    /// See [`open`].
    pub fn new(settings: Settings, times: Times) -> Result<Self, BadSetting> {
        let address = Address::parse(&settings.url)?;
        let topics = Topics::new(&settings.prefix, &settings.station)?;
        let options = options(&settings, &address, topics.client_id(), &offline(&topics, None))?;
        let mut link = Link::new(format!("the broker {address}"), options, times);
        if settings.commands {
            link = link.subscribed(topics.commands());
        }
        let filter = EventFilter::new(settings.events.clone(), settings.recipes.clone())?;
        let Settings { name, commands, recipes, .. } = settings;
        Ok(Self { name, commands, recipes, address, topics, filter, times, link })
    }

    /// Keeps the connection, publishes what the station does, and executes commands, until `closing`.
    pub async fn run(
        &self,
        line: Arc<dyn Line>,
        condition: watch::Receiver<Condition>,
        closing: impl Future<Output = ()>,
    ) {
        let report_then_leave = async {
            tokio::select! {
                () = closing => {}
                () = report(&self.link, &self.topics, condition, self.times.health_interval) => {}
                () = commands::serve(&self.link, &self.topics, line) => {}
            }
            self.link.say_goodbye(&offline(&self.topics, Some(now_ms()))).await;
        };
        tokio::select! {
            () = self.link.keep() => {}
            () = report_then_leave => {}
        }
        self.link.close();
    }
}

#[async_trait]
impl Door for MqttDoor {
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> &'static str {
        "mqtt"
    }

    fn target(&self) -> String {
        let commands =
            if self.commands { format!(", commands on {}", self.topics.commands()) } else { String::new() };
        format!("{}, topics {}{commands}", self.address, self.topics.all())
    }

    fn wants(&self, event: &EventRecord) -> bool {
        self.filter.matches(event)
    }

    async fn deliver(&self, delivery: &Delivery) -> Result<(), Undelivered> {
        let message = Message {
            topic: self.topics.of_event(&delivery.event.kind),
            payload: delivery.message().to_string(),
            retained: false,
            expiry_s: Some(MESSAGE_EXPIRY_S),
            correlation: None,
        };
        self.link.publish(&message).await
    }

    async fn serve(self: Arc<Self>, app: App) {
        let mut status = app.station.watch_status();
        let condition = watch::Sender::new(Condition::default());
        let watched = condition.subscribe();
        let follow = async move {
            loop {
                let now = status.borrow_and_update().clone();
                condition.send_if_modified(|known| {
                    let faults = now.faults.iter().map(|fault| FaultMessage {
                        device: fault.device,
                        kind: fault.kind,
                        detail: fault.detail.clone(),
                        remedy: fault.remedy.clone(),
                        since_ms: fault.since_ms,
                    });
                    let next = Condition {
                        changes: now
                            .state_history
                            .after(0)
                            .map(|(number, state)| (number, state.name()))
                            .collect(),
                        simulated: now.simulated,
                        faults: faults.collect(),
                    };
                    let is_modified = *known != next;
                    *known = next;
                    is_modified
                });
                if status.changed().await.is_err() {
                    // The station is shut down before the doors: its last state stays.
                    std::future::pending::<()>().await;
                }
            }
        };
        let line = Arc::new(AppLine::new(app.clone(), &self.name, &self.recipes));
        tokio::select! {
            () = follow => {}
            () = self.run(line, watched, app.closing.cancelled()) => {}
        }
    }
}
