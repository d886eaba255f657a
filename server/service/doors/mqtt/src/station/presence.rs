//! Publishes the state and the health of the station while the broker is connected.

use std::time::Duration;

use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};

use crate::connection::link::Link;
use crate::connection::message::Message;
use crate::station::topics::Topics;
use crate::station::{Condition, FaultMessage, health, online};

/// Publishes both at the beginning of every connection, since a broker may have lost what it had retained, then every
/// change of the state and, at most once per `health_interval`, the changed health.
pub async fn report(
    link: &Link,
    topics: &Topics,
    mut condition: watch::Receiver<Condition>,
    health_interval: Duration,
) {
    let mut health = Health::default();
    loop {
        let connection = link.up().await;
        tokio::select! {
            () = link.lost(connection) => {}
            () = report_over_connection(link, topics, &mut condition, &mut health, health_interval) => return,
        }
    }
}

/// The health last published, on this connection or an earlier one.
#[derive(Default)]
struct Health {
    /// Its number; 0: none yet.
    seq: u64,
    faults: Vec<FaultMessage>,
}

impl Health {
    /// Takes over what is to be published now: the same again has the same number.
    fn take(&mut self, faults: &[FaultMessage]) {
        if self.seq == 0 || self.faults != faults {
            (self.seq, self.faults) = (self.seq + 1, faults.to_vec());
        }
    }
}

/// Returns when the station no longer reports.
async fn report_over_connection(
    link: &Link,
    topics: &Topics,
    condition: &mut watch::Receiver<Condition>,
    published_health: &mut Health,
    health_interval: Duration,
) {
    let mut published = condition.borrow().newest().saturating_sub(1);
    let mut has_health = false;
    let mut next_health = Instant::now();
    loop {
        let now = condition.borrow_and_update().clone();
        for change in now.changes.iter().filter(|(number, _)| *number > published) {
            publish(link, &online(topics, *change, now.simulated)).await;
        }
        published = now.newest();
        let is_changed = !has_health || published_health.faults != now.faults;
        if is_changed && Instant::now() >= next_health {
            published_health.take(&now.faults);
            publish(link, &health(topics, published_health.seq, &now.faults)).await;
            (has_health, next_health) = (true, Instant::now() + health_interval);
            continue;
        }
        tokio::select! {
            changed = condition.changed() => if changed.is_err() { return },
            () = sleep_until(next_health), if is_changed => {}
        }
    }
}

/// What is not delivered is replaced by the next state, at the latest at the beginning of the next connection.
async fn publish(link: &Link, message: &Message) {
    if let Err(why) = link.publish(message).await {
        tracing::warn!(topic = message.topic, reason = %why, "not published");
    }
}
