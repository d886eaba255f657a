//! What other clients publish to this one.

use rumqttc::v5::mqttbytes::QoS;
use rumqttc::v5::mqttbytes::v5::{Filter, Publish, RetainForwardRule, SubAck, SubscribeReasonCode};
use tokio::sync::{Mutex, mpsc};

use crate::params::COMMANDS_WAITING;

/// A message from another client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Received {
    /// Its bytes.
    pub payload: Vec<u8>,
    /// Whether it was published to be kept.
    pub retained: bool,
    /// Time until the broker would have dropped it.
    pub expiry_s: Option<u32>,
    /// Where an answer is expected.
    pub response_topic: Option<String>,
    /// What the answer must contain.
    pub correlation: Option<Vec<u8>>,
}

/// A topic, and what has arrived on it.
pub struct Subscription {
    topic: String,
    arriving: mpsc::Sender<Received>,
    arrived: Mutex<mpsc::Receiver<Received>>,
}

impl Subscription {
    /// Of this topic.
    pub fn new(topic: String) -> Self {
        let (arriving, arrived) = mpsc::channel(COMMANDS_WAITING);
        Self { topic, arriving, arrived: Mutex::new(arrived) }
    }

    /// Whether it is of this topic.
    pub fn is_of(&self, topic: &str) -> bool {
        self.topic == topic
    }

    /// As the broker is asked for it: without what it has retained, and with a mark on what is to be retained.
    pub fn filter(&self) -> Filter {
        Filter {
            preserve_retain: true,
            retain_forward_rule: RetainForwardRule::Never,
            ..Filter::new(&self.topic, QoS::AtLeastOnce)
        }
    }

    /// A message arrives; too many at a time are dropped.
    pub fn receive(&self, publish: Publish) {
        let properties = publish.properties.unwrap_or_default();
        let received = Received {
            payload: publish.payload.to_vec(),
            retained: publish.retain,
            expiry_s: properties.message_expiry_interval,
            response_topic: properties.response_topic,
            correlation: properties.correlation_data.map(|data| data.to_vec()),
        };
        if self.arriving.try_send(received).is_err() {
            tracing::warn!(topic = self.topic, "a message was dropped: {COMMANDS_WAITING} wait already");
        }
    }

    /// The next message.
    pub async fn next(&self) -> Received {
        match self.arrived.lock().await.recv().await {
            Some(received) => received,
            // The sender is a field of this.
            None => std::future::pending().await,
        }
    }
}

/// Logs a refusal.
pub fn check_subscription(answer: &SubAck, broker: &str) {
    let is_accepted = |code: &SubscribeReasonCode| matches!(code, SubscribeReasonCode::Success(_));
    if !answer.return_codes.iter().all(is_accepted) {
        let codes = format!("{:?}", answer.return_codes);
        tracing::error!(broker, codes, "the broker refuses the subscription to commands");
    }
}
