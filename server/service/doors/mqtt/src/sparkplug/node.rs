//! The edge node: what it has announced, and the numbers of its messages.

use std::collections::BTreeMap;

use app::doors::{InspectionMessage, Undelivered, now_ms};
use prost::Message as _;
use tokio::sync::Mutex;

use crate::connection::link::Link;
use crate::connection::message::Message;
use crate::sparkplug::metrics::{
    bd_seq_metric, changed, have_the_same_names, of_birth, of_inspection, of_station,
};
use crate::sparkplug::payload::{Metric, Payload};
use crate::sparkplug::topics::SparkplugTopics;
use crate::station::Condition;

/// The edge node. Messages leave in the order of their numbers, also those of different tasks.
pub struct Node {
    topics: SparkplugTopics,
    announced: Mutex<Announced>,
}

struct Announced {
    /// The connection over which the node was born.
    over: Option<u64>,
    /// Number of the next message.
    seq: u8,
    station: Vec<Metric>,
    /// The last result of each recipe.
    devices: BTreeMap<String, Vec<Metric>>,
}

impl Node {
    /// Not born yet.
    pub fn new(topics: SparkplugTopics) -> Self {
        let station = of_station(&Condition::default(), None);
        let announced = Announced { over: None, seq: 0, station, devices: BTreeMap::new() };
        Self { topics, announced: Mutex::new(announced) }
    }

    /// Its topics.
    pub fn topics(&self) -> &SparkplugTopics {
        &self.topics
    }

    /// Its death after this connection, as the broker or the node itself announces it.
    pub fn death(topics: &SparkplugTopics, connection: u64) -> Message {
        let payload = Payload {
            // The broker publishes it later, at a time that is not known.
            timestamp: None,
            metrics: vec![bd_seq_metric(bd_seq(connection))],
            seq: None,
        };
        Message::binary(topics.node("NDEATH"), payload.encode_to_vec())
    }

    /// Announces what has changed at the station, or the birth if it was not announced over this connection.
    ///
    /// # Errors
    /// The connection is lost.
    pub async fn show_station(
        &self,
        link: &Link,
        connection: u64,
        metrics: Vec<Metric>,
    ) -> Result<(), Undelivered> {
        let mut announced = self.announced.lock().await;
        let changed = changed(&metrics, &announced.station);
        announced.station = metrics;
        if announced.over != Some(connection) {
            return self.birth(&mut announced, link, connection).await;
        }
        if changed.is_empty() {
            return Ok(());
        }
        self.send(&mut announced, link, connection, self.topics.node("NDATA"), changed).await
    }

    /// Announces a result, after the birth of its recipe if that has other metrics than before.
    ///
    /// # Errors
    /// The connection is lost.
    pub async fn show_result(
        &self,
        link: &Link,
        connection: u64,
        inspection: &InspectionMessage,
    ) -> Result<(), Undelivered> {
        let (device, metrics) = (&inspection.recipe.id, of_inspection(inspection));
        let mut announced = self.announced.lock().await;
        let is_known = announced.devices.get(device).is_some_and(|known| have_the_same_names(known, &metrics));
        if announced.over == Some(connection) && !is_known {
            let topic = self.topics.device("DBIRTH", device);
            self.send(&mut announced, link, connection, topic, metrics.clone()).await?;
        }
        announced.devices.insert(device.clone(), metrics.clone());
        if announced.over != Some(connection) {
            self.birth(&mut announced, link, connection).await?;
        }
        self.send(&mut announced, link, connection, self.topics.device("DDATA", device), metrics).await
    }

    /// Announces everything again, as a host asks that has missed something.
    ///
    /// # Errors
    /// The connection is lost.
    pub async fn rebirth(&self, link: &Link, connection: u64) -> Result<(), Undelivered> {
        let mut announced = self.announced.lock().await;
        self.birth(&mut announced, link, connection).await
    }

    async fn birth(&self, announced: &mut Announced, link: &Link, connection: u64) -> Result<(), Undelivered> {
        (announced.over, announced.seq) = (None, 0);
        let metrics = [of_birth(bd_seq(connection)), announced.station.clone()].concat();
        self.send(announced, link, connection, self.topics.node("NBIRTH"), metrics).await?;
        for (device, metrics) in announced.devices.clone() {
            self.send(announced, link, connection, self.topics.device("DBIRTH", &device), metrics).await?;
        }
        announced.over = Some(connection);
        Ok(())
    }

    async fn send(
        &self,
        announced: &mut Announced,
        link: &Link,
        connection: u64,
        topic: String,
        metrics: Vec<Metric>,
    ) -> Result<(), Undelivered> {
        let seq = announced.seq;
        let payload = Payload { timestamp: Some(now_ms().cast_unsigned()), metrics, seq: Some(seq.into()) };
        link.send(connection, topic, payload.encode_to_vec()).await?;
        // Not before: a delivery may be cancelled while it waits.
        announced.seq = seq.wrapping_add(1);
        Ok(())
    }
}

/// The number of a connection in births and deaths.
fn bd_seq(connection: u64) -> u8 {
    // From 0 on; connections are counted from 1.
    (connection.wrapping_sub(1) % 256) as u8
}
