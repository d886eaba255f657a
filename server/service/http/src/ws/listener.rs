//! The half of a connection that reads from the client.

use parking_lot::Mutex;

use axum::extract::ws::{Message, WebSocket};
use futures_util::StreamExt;
use futures_util::stream::SplitStream;
use live::protocol::text::{Command, Misunderstanding, Request, ServerText, parse};
use live::protocol::{CLIENT_MESSAGE_BURST, CLIENT_MESSAGES_PER_S, MAX_CLIENT_MESSAGE_BYTES, close};
use serde_json::json;
use tokio::sync::mpsc;
use tokio::time::Instant;

use crate::ws::station::Station;

/// Why a connection ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// The client has gone or cannot be reached.
    Gone,
    /// The server closes it.
    Close {
        /// Close code.
        code: u16,
        /// Reason text for the client's log.
        reason: &'static str,
    },
}

/// When the client last sent something.
pub struct LastReceived(Mutex<Instant>);

impl LastReceived {
    /// Now.
    pub fn now() -> Self {
        Self(Mutex::new(Instant::now()))
    }

    /// The moment.
    pub fn at(&self) -> Instant {
        *self.0.lock()
    }

    fn note(&self) {
        *self.0.lock() = Instant::now();
    }
}

/// What the sending half has to reply.
pub enum Received {
    /// The request, or why it was not understood.
    Asked(Result<Request, Misunderstanding>),
    /// A finished reply.
    Answer(String),
}

/// Reads from the client until it disconnects or breaks a rule; its requests go to `answers`. Stop is carried out here
/// immediately, regardless of unread data and message limits.
pub async fn listen(
    mut from_client: SplitStream<WebSocket>,
    answers: mpsc::Sender<Received>,
    last_received: &LastReceived,
    station: &dyn Station,
) -> End {
    let mut allowance = Allowance { left: CLIENT_MESSAGE_BURST, at: Instant::now() };
    loop {
        let message = match from_client.next().await {
            None => return End::Gone,
            Some(Err(error)) => return end_by(error),
            Some(Ok(message)) => message,
        };
        last_received.note();
        let asked = match &message {
            Message::Text(text) if text.len() <= MAX_CLIENT_MESSAGE_BYTES => Some(parse(text)),
            _ => None,
        };
        if let Some(Ok(Request { id, command: Command::Stop { actor } })) = asked {
            let (stopping, answers) = (station.stop(actor.as_deref()), answers.clone());
            tokio::spawn(async move {
                let stopped = json!(stopping.await);
                let answer = ServerText::Stopped { id, stopped: &stopped }.to_json();
                // The client may be gone; the station is stopped in any case.
                let _ = answers.send(Received::Answer(answer)).await;
            });
            continue;
        }
        if !allowance.take(Instant::now()) {
            return End::Close { code: close::POLICY, reason: "too many messages" };
        }
        match (message, asked) {
            (_, Some(asked)) => {
                if answers.send(Received::Asked(asked)).await.is_err() {
                    return End::Gone;
                }
            }
            (Message::Close(_), None) => return End::Gone,
            (Message::Ping(_) | Message::Pong(_), None) => {}
            (Message::Binary(_), None) => {
                return End::Close { code: close::UNSUPPORTED, reason: "binary messages are not supported" };
            }
            (Message::Text(_), None) => {
                return End::Close { code: close::TOO_BIG, reason: "the message is too long" };
            }
        }
    }
}

/// A client's message that cannot be read.
fn end_by(error: axum::Error) -> End {
    use tungstenite::Error;
    use tungstenite::error::ProtocolError;
    match error.into_inner().downcast_ref() {
        Some(Error::Protocol(ProtocolError::ResetWithoutClosingHandshake)) => End::Gone,
        Some(Error::Protocol(_)) => End::Close { code: close::PROTOCOL, reason: "WebSocket protocol violation" },
        Some(Error::Utf8(_)) => End::Close { code: close::NOT_UTF8, reason: "the text is not UTF-8" },
        Some(Error::Capacity(_)) => End::Close { code: close::TOO_BIG, reason: "the message is too long" },
        _ => End::Gone,
    }
}

/// Rate limit of client messages (token bucket).
struct Allowance {
    left: f64,
    at: Instant,
}

impl Allowance {
    fn take(&mut self, now: Instant) -> bool {
        let grown = now.duration_since(self.at).as_secs_f64() * CLIENT_MESSAGES_PER_S;
        (self.left, self.at) = ((self.left + grown).min(CLIENT_MESSAGE_BURST), now);
        let allowed = self.left >= 1.0;
        self.left -= f64::from(u8::from(allowed));
        allowed
    }
}
