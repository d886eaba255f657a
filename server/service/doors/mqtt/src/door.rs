//! The door.

use std::sync::Arc;

use app::App;
use app::doors::{BadSetting, Delivery, Door, EventFilter, EventRecord, Undelivered, now_ms};
use async_trait::async_trait;
use tokio::sync::watch;

use crate::commands::{self, AppLine, Line};
use crate::connection::address::Address;
use crate::connection::link::Link;
use crate::connection::message::{Message, Will};
use crate::connection::options::options;
use crate::params::{MESSAGE_EXPIRY_S, Times};
use crate::settings::Settings;
use crate::sparkplug::{self, Node, SparkplugTopics};
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
    /// With Sparkplug.
    node: Option<Node>,
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
        let options = options(&settings, &address, topics.client_id())?;
        let edge = settings.sparkplug_group.as_deref().map(|group| SparkplugTopics::new(group, &settings.station));
        let edge = edge.transpose()?;
        let will: Will = match edge.clone() {
            Some(edge) => Box::new(move |connection| Node::death(&edge, connection)),
            None => {
                let topics = topics.clone();
                Box::new(move |_| offline(&topics, None))
            }
        };
        let mut link = Link::new(format!("the broker {address}"), options, times, will);
        if settings.commands {
            link.subscribe(topics.commands());
        }
        if let Some(edge) = &edge {
            link.subscribe(edge.node("NCMD"));
        }
        let filter = EventFilter::new(settings.events.clone(), settings.recipes.clone())?;
        let Settings { name, commands, recipes, .. } = settings;
        let node = edge.map(Node::new);
        Ok(Self { name, commands, recipes, address, topics, node, filter, times, link })
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
                () = self.report(condition) => {}
                () = commands::serve(&self.link, &self.topics, line) => {}
            }
            let last = |connection| match &self.node {
                Some(node) => Node::death(node.topics(), connection),
                None => offline(&self.topics, Some(now_ms())),
            };
            self.link.say_goodbye(last).await;
        };
        tokio::select! {
            () = self.link.keep() => {}
            () = report_then_leave => {}
        }
        self.link.close();
    }

    /// Shows a result to hosts of Sparkplug; returns the connection over which it was sent.
    async fn show_result(&self, delivery: &Delivery) -> Result<Option<u64>, Undelivered> {
        let (Some(node), Some(inspection)) = (&self.node, &delivery.inspection) else { return Ok(None) };
        let connection = self.link.connection().await?;
        node.show_result(&self.link, connection, inspection).await?;
        Ok(Some(connection))
    }

    async fn report(&self, condition: watch::Receiver<Condition>) {
        match &self.node {
            Some(node) => sparkplug::report(&self.link, node, condition).await,
            None => report(&self.link, &self.topics, condition, self.times.health_interval).await,
        }
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
        let topics =
            self.node.as_ref().map_or_else(String::new, |node| format!("{} and ", node.topics().node("+")));
        format!("{}, topics {topics}{}{commands}", self.address, self.topics.all())
    }

    fn wants(&self, event: &EventRecord) -> bool {
        self.filter.matches(event)
    }

    async fn deliver(&self, delivery: &Delivery) -> Result<(), Undelivered> {
        let shown_over = self.show_result(delivery).await?;
        let topic = self.topics.of_event(&delivery.event.kind);
        self.link.publish(&Message::json(topic, &delivery.message(), Some(MESSAGE_EXPIRY_S))).await?;
        // A broker handles a connection in order, so that this acknowledgement is also one for what was sent before.
        match shown_over {
            Some(connection) if self.link.connection().await? != connection => {
                Err(Undelivered::unreachable("the connection to the broker was lost before the acknowledgement"))
            }
            _ => Ok(()),
        }
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
                        changes: now.state_history.after(0).collect(),
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
