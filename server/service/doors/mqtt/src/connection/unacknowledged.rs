//! Messages that the broker has not acknowledged yet, and who waits for them.
//!
//! The client library numbers a message when it sends it, and reports only that number. Messages leave in the order in
//! which they were handed over, so the first one handed over is the one that was sent; its acknowledgement has the same
//! number. This holds as long as the library sends nothing else: what it keeps for the next connection is discarded.

use std::collections::{HashMap, VecDeque};

use rumqttc::v5::mqttbytes::v5::PubAck;
use tokio::sync::oneshot;

use app::doors::Undelivered;

/// Receives the acknowledgement, or why there will be none.
pub type Acknowledgement = oneshot::Receiver<Result<PubAck, Undelivered>>;

type Waiter = oneshot::Sender<Result<PubAck, Undelivered>>;

/// All that is on its way over one connection. Who waits may have given up: the message then stays until it is
/// acknowledged.
#[derive(Debug, Default)]
pub struct Unacknowledged {
    /// The connection, if there is one.
    connection: Option<u64>,
    /// Handed over to the library, not sent yet.
    queued: VecDeque<Waiter>,
    /// Sent, by packet id.
    sent: HashMap<u16, Waiter>,
}

impl Unacknowledged {
    /// A connection is established.
    pub fn begin(&mut self, connection: u64) {
        self.connection = Some(connection);
    }

    /// Acts if this connection still exists; nothing ends it meanwhile.
    pub fn over<T>(&self, connection: u64, act: impl FnOnce() -> T) -> Option<T> {
        (self.connection == Some(connection)).then(act)
    }

    /// Hands a message over to the library by `hand_over`, which returns whether the library took it; `None` if it did
    /// not, or if there is no connection.
    pub fn hand_over(&mut self, hand_over: impl FnOnce() -> bool) -> Option<Acknowledgement> {
        if self.connection.is_none() || !hand_over() {
            return None;
        }
        let (waiter, acknowledgement) = oneshot::channel();
        self.queued.push_back(waiter);
        Some(acknowledgement)
    }

    /// The library has sent the next message, with this packet id.
    pub fn sent(&mut self, packet_id: u16) {
        match self.queued.pop_front() {
            Some(waiter) => drop(self.sent.insert(packet_id, waiter)),
            None => tracing::error!(packet_id, "a message was sent that nobody handed over"),
        }
    }

    /// The broker has acknowledged a message.
    pub fn acknowledged(&mut self, acknowledgement: PubAck) {
        match self.sent.remove(&acknowledgement.pkid) {
            // Nobody waits any more if the delivery was cancelled.
            Some(waiter) => drop(waiter.send(Ok(acknowledgement))),
            None => {
                tracing::error!(packet_id = acknowledgement.pkid, "a message was acknowledged that was not sent")
            }
        }
    }

    /// The connection is lost: nothing on its way counts as delivered.
    pub fn lost(&mut self, why: &Undelivered) {
        self.connection = None;
        let waiters = self.queued.drain(..).chain(self.sent.drain().map(|(_, waiter)| waiter));
        for waiter in waiters {
            drop(waiter.send(Err(why.clone())));
        }
    }
}
