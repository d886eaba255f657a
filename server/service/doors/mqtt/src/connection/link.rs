//! The connection to the broker: established again whenever it breaks, and messages over it.

use std::time::Duration;

use app::doors::Undelivered;
use parking_lot::Mutex;
use rumqttc::Outgoing;
use rumqttc::v5::mqttbytes::QoS;
use rumqttc::v5::mqttbytes::v5::{ConnAck, Filter, Packet, PublishProperties};
use rumqttc::v5::{AsyncClient, Event, EventLoop, MqttOptions};
use tokio::sync::{Notify, watch};
use tokio::time::{Instant, sleep, timeout};

use crate::connection::message::{Message, Will};
use crate::connection::options::last_will;
use crate::connection::reasons::{QOS_MISSING, of_acknowledgement, of_connection, of_lost_message};
use crate::connection::state::{Ending, LinkState};
use crate::connection::subscription::{Received, Subscription, check_subscription};
use crate::connection::unacknowledged::Unacknowledged;
use crate::params::{HANDED_OVER_AGAIN, PACKET_OVERHEAD_BYTES, Times, UNACKNOWLEDGED_MESSAGES};

/// Why there is no connection at the end.
const GOODBYE: &str = "the service is being shut down";

/// The connection.
pub struct Link {
    /// The broker in messages: "the broker mqtt://host:1883".
    broker: String,
    times: Times,
    client: AsyncClient,
    /// Until [`Link::keep`].
    event_loop: Mutex<Option<EventLoop>>,
    state: watch::Sender<LinkState>,
    unacknowledged: Mutex<Unacknowledged>,
    subscriptions: Vec<Subscription>,
    will: Will,
    /// Ends the delay before the next attempt.
    try_now: Notify,
    /// Ends a connection over which a message was not acknowledged.
    give_up: Notify,
}

impl Link {
    /// Not connected before [`Link::keep`].
    pub fn new(broker: String, options: MqttOptions, times: Times, will: Will) -> Self {
        let (client, event_loop) = AsyncClient::new(options, usize::from(UNACKNOWLEDGED_MESSAGES));
        Self {
            broker,
            times,
            client,
            event_loop: Mutex::new(Some(event_loop)),
            state: watch::Sender::new(LinkState::Connecting),
            unacknowledged: Mutex::default(),
            subscriptions: Vec::new(),
            will,
            try_now: Notify::new(),
            give_up: Notify::new(),
        }
    }

    /// Also receives what is published on a topic.
    pub fn subscribe(&mut self, topic: String) {
        self.subscriptions.push(Subscription::new(topic));
    }

    /// The next message of another client on a topic; waits for ever without a subscription.
    pub async fn received(&self, topic: &str) -> Received {
        match self.subscriptions.iter().find(|subscription| subscription.is_of(topic)) {
            Some(subscription) => subscription.next().await,
            None => std::future::pending().await,
        }
    }

    /// Publishes; returns once the broker has acknowledged.
    ///
    /// While the broker is not connected, this fails with the reason of an attempt that it causes, and does not wait for
    /// further ones.
    ///
    /// # Errors
    /// The broker is not connected, refuses the message, or does not acknowledge it in time.
    pub async fn publish(&self, message: &Message) -> Result<(), Undelivered> {
        let limit = self.times.acknowledged_within;
        timeout(limit, self.publish_and_wait(message)).await.unwrap_or_else(|_| {
            // The broker does not do its work over this connection; perhaps it does over the next one.
            self.give_up.notify_one();
            let reason = format!("{} did not acknowledge within {} s", self.broker, limit.as_secs_f64());
            Err(Undelivered::unreachable(reason))
        })
    }

    async fn publish_and_wait(&self, message: &Message) -> Result<(), Undelivered> {
        let (_, max_packet_bytes) = self.connected().await?;
        // A property is one byte, its length two.
        let correlation_bytes = message.correlation.as_ref().map_or(0, |correlation| 3 + correlation.len());
        let packet_bytes = message.topic.len() + message.payload.len() + correlation_bytes + PACKET_OVERHEAD_BYTES;
        if let Some(max) = max_packet_bytes.filter(|max| packet_bytes > *max as usize) {
            let reason = format!("the message has {packet_bytes} bytes; {} accepts at most {max}", self.broker);
            return Err(Undelivered::Impossible(reason));
        }
        let Message { topic, payload, content_type, retained, expiry_s, correlation } = message.clone();
        let properties = PublishProperties {
            payload_format_indicator: content_type.map(|_| 1),
            message_expiry_interval: expiry_s,
            content_type: content_type.map(str::to_owned),
            correlation_data: correlation.map(Into::into),
            ..PublishProperties::default()
        };
        // It fails if the queue is full, that is if nothing leaves.
        let publish = || {
            let client = &self.client;
            client.try_publish_with_properties(topic, QoS::AtLeastOnce, retained, payload, properties).is_ok()
        };
        let acknowledgement = self.unacknowledged.lock().hand_over(publish);
        let lost = || Undelivered::unreachable(format!("{} is no longer connected", self.broker));
        let acknowledgement = acknowledgement.ok_or_else(lost)?.await.map_err(|_| lost())??;
        of_acknowledgement(&acknowledgement, &message.topic)
    }

    /// Sends without acknowledgement (QoS 0), if this connection still exists.
    ///
    /// # Errors
    /// It does not.
    pub async fn send(&self, connection: u64, topic: String, payload: Vec<u8>) -> Result<(), Undelivered> {
        loop {
            let send = || self.client.try_publish(&topic, QoS::AtMostOnce, false, payload.clone()).is_ok();
            let outcome = self.unacknowledged.lock().over(connection, send);
            match outcome {
                Some(true) => return Ok(()),
                Some(false) => sleep(HANDED_OVER_AGAIN).await,
                None => {
                    return Err(Undelivered::unreachable(format!("{} is no longer connected", self.broker)));
                }
            }
        }
    }

    /// The number of the connection; as for [`Link::publish`], it is established if there is none.
    ///
    /// # Errors
    /// The broker is not connected.
    pub async fn connection(&self) -> Result<u64, Undelivered> {
        let limit = self.times.acknowledged_within;
        let connected = timeout(limit, self.connected()).await;
        let late = || Undelivered::unreachable(format!("{} is not connected yet", self.broker));
        Ok(connected.map_err(|_| late())??.0)
    }

    /// Waits for the end of an attempt to connect, which it causes if none is being made; returns the number of the
    /// connection, and the largest packet that the broker accepts.
    async fn connected(&self) -> Result<(u64, Option<u32>), Undelivered> {
        let mut state = self.state.subscribe();
        if matches!(*state.borrow_and_update(), LinkState::Down { .. }) {
            self.try_now.notify_one();
            // The sender is a field of this.
            let _ = state.changed().await;
        }
        let decided = state.wait_for(|state| *state != LinkState::Connecting).await;
        match decided.map(|state| state.clone()) {
            Ok(LinkState::Up { connection, max_packet_bytes }) => Ok((connection, max_packet_bytes)),
            Ok(LinkState::Down { reason }) => {
                Err(Undelivered::unreachable(format!("{} is not connected: {reason}", self.broker)))
            }
            Ok(LinkState::Connecting | LinkState::Closed) | Err(_) => {
                Err(Undelivered::unreachable(format!("{} is not connected: {GOODBYE}", self.broker)))
            }
        }
    }

    /// Waits for a connection; returns its number.
    pub async fn up(&self) -> u64 {
        let mut state = self.state.subscribe();
        loop {
            if let LinkState::Up { connection, .. } = *state.borrow_and_update() {
                return connection;
            }
            // The sender is a field of this.
            let _ = state.changed().await;
        }
    }

    /// Waits for the end of this connection.
    pub async fn lost(&self, connection: u64) {
        let is_over =
            |state: &LinkState| !matches!(state, LinkState::Up { connection: now, .. } if *now == connection);
        let _ = self.state.subscribe().wait_for(is_over).await;
    }

    /// Connects, and connects again whenever the connection breaks; returns after [`Link::say_goodbye`].
    pub async fn keep(&self) {
        let Some(mut event_loop) = self.event_loop.lock().take() else { return };
        let mut delay = self.times.reconnect_first;
        for connection in 1.. {
            self.state.send_replace(LinkState::Connecting);
            event_loop.options.set_last_will(last_will((self.will)(connection)));
            let begun = Instant::now();
            let (reason, undelivered) = match self.connect(&mut event_loop, connection).await {
                Ending::Goodbye => return,
                Ending::Failed(error) => (of_connection(&error), of_lost_message(&error, &self.broker)),
                Ending::Useless(reason) => (reason.clone(), Undelivered::unreachable(reason)),
            };
            tracing::warn!(broker = self.broker, reason, "not connected");
            // First, so that whoever waits for a message finds this state when its wait ends.
            self.state.send_replace(LinkState::Down { reason });
            self.discard(&mut event_loop, &undelivered);
            if begun.elapsed() > self.times.reconnect_last {
                delay = self.times.reconnect_first;
            }
            self.pause(delay).await;
            delay = (delay * 2).min(self.times.reconnect_last);
        }
    }

    async fn pause(&self, delay: Duration) {
        tokio::select! {
            () = sleep(delay) => {}
            () = self.try_now.notified() => {}
        }
    }

    /// Serves one connection until its end.
    async fn connect(&self, event_loop: &mut EventLoop, connection: u64) -> Ending {
        loop {
            let event = tokio::select! {
                event = event_loop.poll() => event,
                () = self.give_up.notified() => {
                    return Ending::Useless("a message was not acknowledged in time".to_owned());
                }
            };
            match event {
                Ok(Event::Incoming(Packet::ConnAck(accepted))) => {
                    if let Err(ending) = self.begin(&accepted, connection) {
                        return ending;
                    }
                }
                // Without acknowledgement there is no packet id.
                Ok(Event::Outgoing(Outgoing::Publish(0))) => {}
                Ok(Event::Outgoing(Outgoing::Publish(packet_id))) => self.unacknowledged.lock().sent(packet_id),
                Ok(Event::Incoming(Packet::PubAck(acknowledgement))) => {
                    self.unacknowledged.lock().acknowledged(acknowledgement);
                }
                Ok(Event::Incoming(Packet::Publish(publish))) => {
                    // A session from before may have a subscription that is no longer wanted.
                    let topic = String::from_utf8_lossy(&publish.topic).into_owned();
                    if let Some(of) = self.subscriptions.iter().find(|subscription| subscription.is_of(&topic)) {
                        of.receive(publish);
                    }
                }
                Ok(Event::Incoming(Packet::SubAck(answer))) => check_subscription(&answer, &self.broker),
                Ok(Event::Outgoing(Outgoing::Disconnect)) => return Ending::Goodbye,
                Ok(_) => {}
                Err(error) => return Ending::Failed(error),
            }
        }
    }

    fn begin(&self, accepted: &ConnAck, connection: u64) -> Result<(), Ending> {
        let properties = accepted.properties.as_ref();
        if properties.and_then(|properties| properties.max_qos) == Some(0) {
            return Err(Ending::Useless(QOS_MISSING.to_owned()));
        }
        let max_packet_bytes = properties.and_then(|properties| properties.max_packet_size);
        tracing::info!(broker = self.broker, "connected");
        self.ask_for_subscriptions();
        self.unacknowledged.lock().begin(connection);
        self.state.send_replace(LinkState::Up { connection, max_packet_bytes });
        Ok(())
    }

    /// At the beginning of every connection, since the broker may have forgotten the session.
    fn ask_for_subscriptions(&self) {
        let filters: Vec<Filter> = self.subscriptions.iter().map(Subscription::filter).collect();
        if !filters.is_empty() && self.client.try_subscribe_many(filters).is_err() {
            tracing::error!(broker = self.broker, "not subscribed to commands: too much is queued");
        }
    }

    /// Discards what the library keeps for the next connection. It would send some of it again, or nothing, depending on
    /// whether the broker knows the session; whoever waits for a message publishes it again. Nothing can be handed over
    /// meanwhile.
    fn discard(&self, event_loop: &mut EventLoop, undelivered: &Undelivered) {
        let mut unacknowledged = self.unacknowledged.lock();
        unacknowledged.lost(undelivered);
        event_loop.clean();
        event_loop.pending.clear();
        event_loop.state.events.clear();
        event_loop.state.collision = None;
    }

    /// Publishes this last message of the connection with that number, if there is one, and ends it such that the broker
    /// does not publish the will.
    pub async fn say_goodbye(&self, last: impl Fn(u64) -> Message) {
        let LinkState::Up { connection, .. } = *self.state.borrow() else { return };
        let goodbye = async {
            if let Err(why) = self.publish(&last(connection)).await {
                tracing::warn!(broker = self.broker, reason = %why, "the last message was not delivered");
            }
            // The connection ends with the event loop if it cannot be ended by a packet.
            let _ = self.client.disconnect().await;
            std::future::pending::<()>().await;
        };
        let _ = timeout(self.times.goodbye_within, goodbye).await;
    }

    /// Nothing is published any more.
    pub fn close(&self) {
        self.state.send_replace(LinkState::Closed);
        self.unacknowledged.lock().lost(&Undelivered::unreachable(GOODBYE));
    }
}
