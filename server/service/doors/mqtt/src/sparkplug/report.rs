//! Announces the station while the broker is connected, and answers hosts that ask for a birth.

use prost::Message as _;
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};

use app::doors::Undelivered;

use crate::connection::link::Link;
use crate::params::BIRTH_INTERVAL;
use crate::sparkplug::metrics::{is_rebirth, of_station};
use crate::sparkplug::node::Node;
use crate::sparkplug::payload::Payload;
use crate::station::Condition;

/// Returns when the station no longer reports.
pub async fn report(link: &Link, node: &Node, mut condition: watch::Receiver<Condition>) {
    loop {
        let connection = link.up().await;
        tokio::select! {
            () = link.lost(connection) => {}
            outcome = report_over_connection(link, node, connection, &mut condition) => match outcome {
                Ok(()) => return,
                Err(why) => {
                    tracing::warn!(reason = %why, "the station was not announced");
                    link.lost(connection).await;
                }
            }
        }
    }
}

async fn report_over_connection(
    link: &Link,
    node: &Node,
    connection: u64,
    condition: &mut watch::Receiver<Condition>,
) -> Result<(), Undelivered> {
    let commands = node.topics().node("NCMD");
    let mut shown = condition.borrow().newest().saturating_sub(1);
    let mut next_birth = Instant::now() + BIRTH_INTERVAL;
    loop {
        let now = condition.borrow_and_update().clone();
        for &(_, state) in now.changes.iter().filter(|(number, _)| *number > shown) {
            node.show_station(link, connection, of_station(&now, Some(state))).await?;
        }
        shown = now.newest();
        // The faults may have changed without the state; before the first state, this is the birth.
        let state = now.changes.last().map(|(_, state)| *state);
        node.show_station(link, connection, of_station(&now, state)).await?;
        tokio::select! {
            changed = condition.changed() => if changed.is_err() { return Ok(()) },
            command = link.received(&commands) => {
                if Payload::decode(&*command.payload).is_ok_and(|command| is_rebirth(&command)) {
                    sleep_until(next_birth).await;
                    node.rebirth(link, connection).await?;
                    next_birth = Instant::now() + BIRTH_INTERVAL;
                }
            }
        }
    }
}
