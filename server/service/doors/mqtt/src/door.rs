//! The door.

use std::sync::Arc;

use app::App;
use app::doors::{BadSetting, Delivery, Door, EventFilter, EventRecord, Undelivered, now_ms};
use async_trait::async_trait;
use tokio::sync::watch;

use crate::address::Address;
use crate::link::{Link, Message};
use crate::options::options;
use crate::params::{MESSAGE_EXPIRY_S, Times};
use crate::presence::report;
use crate::settings::Settings;
use crate::station::{Condition, FaultMessage, offline};
use crate::topics::Topics;

/// Publishes events to a broker.
pub struct MqttDoor {
    name: String,
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
        let link = Link::new(format!("the broker {address}"), options, times);
        let filter = EventFilter::new(settings.events, settings.recipes)?;
        Ok(Self { name: settings.name, address, topics, filter, times, link })
    }

    /// Keeps the connection and publishes what the station does, until `closing`.
    pub async fn run(&self, condition: watch::Receiver<Condition>, closing: impl Future<Output = ()>) {
        let report_then_leave = async {
            tokio::select! {
                () = closing => {}
                () = report(&self.link, &self.topics, condition, self.times.health_interval) => {}
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
        format!("{}, topics {}", self.address, self.topics.all())
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
        tokio::select! {
            () = follow => {}
            () = self.run(watched, app.closing.cancelled()) => {}
        }
    }
}
