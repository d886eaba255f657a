//! One client connection: its messages and what it is sent.
//!
//! One message is in flight at a time; until the client has read it, newer images replace older ones and nothing piles
//! up.

use axum::extract::ws::{CloseFrame, Message, WebSocket};
use bytes::Bytes;
use futures_util::stream::SplitSink;
use futures_util::{SinkExt, StreamExt};
use live::protocol::text::{Command, Limits, Request, ServerText};
use live::protocol::{CLIENT_MESSAGES_PER_S, MAX_CLIENT_MESSAGE_BYTES, MAX_RATE_HZ, SUB_PROTOCOL, close};
use tokio::sync::mpsc;
use tokio::time::{Duration, Instant, sleep_until, timeout};

use crate::ws::feeds::{Feeds, Next};
use crate::ws::listener::{End, LastReceived, Received, listen};
use crate::ws::station::Station;
use crate::ws::streams::Streams;

/// Ping interval: a lost viewer must be noticed well within the 4 s after which the live laser is turned off.
const PING_EVERY: Duration = Duration::from_secs(1);
/// A client that has sent or read nothing for this long is disconnected: many pings, and together with a full send
/// buffer less than the 30 s promised.
const SILENCE_LIMIT: Duration = Duration::from_secs(15);
/// Timeout of the close handshake.
const FAREWELL_LIMIT: Duration = Duration::from_secs(1);
/// Requests that may wait while a message is in flight.
const WAITING_REQUESTS: usize = 8;

/// Serves a client until it disconnects or is disconnected.
pub async fn serve(socket: WebSocket, streams: Streams, station: &dyn Station) {
    let (to_client, from_client) = socket.split();
    let (requests, asked) = mpsc::channel(WAITING_REQUESTS);
    let last_received = LastReceived::now();
    let mut speaker =
        Speaker { to_client, asked, feeds: Feeds::default(), streams, last_received: &last_received, station };
    let end = tokio::select! {
        end = listen(from_client, requests, &last_received, station) => end,
        end = speaker.speak() => end,
    };
    if let End::Close { code, reason } = end {
        let farewell = Message::Close(Some(CloseFrame { code, reason: reason.into() }));
        // The client may be gone already.
        let _ = timeout(FAREWELL_LIMIT, speaker.to_client.send(farewell)).await;
    }
}

/// The sending half of a connection.
struct Speaker<'a> {
    to_client: SplitSink<WebSocket, Message>,
    asked: mpsc::Receiver<Received>,
    feeds: Feeds,
    streams: Streams,
    last_received: &'a LastReceived,
    station: &'a dyn Station,
}

impl Speaker<'_> {
    async fn speak(&mut self) -> End {
        match self.until_end().await {
            Ok(never) => match never {},
            Err(end) => end,
        }
    }

    async fn until_end(&mut self) -> Result<std::convert::Infallible, End> {
        self.send(hello(&self.streams)).await?;
        let mut ping_at = Instant::now() + PING_EVERY;
        loop {
            let now = Instant::now();
            if self.streams.closing.is_cancelled() {
                return Err(End::Close { code: close::GOING_AWAY, reason: "server shutdown" });
            }
            if now >= self.last_received.at() + SILENCE_LIMIT {
                return Err(End::Close { code: close::SILENT, reason: "no message from the client" });
            }
            if self.feeds.shows_frames() {
                self.station.note_viewer(self.last_received.at().into_std());
            }
            if now >= ping_at {
                ping_at = now + PING_EVERY;
                self.send(Message::Ping(Bytes::new())).await?;
            }
            while let Ok(request) = self.asked.try_recv() {
                let answer = self.answer(request);
                self.send(answer).await?;
            }
            match self.feeds.next(Instant::now(), &self.streams) {
                Next::Message(message) => self.send(message).await?,
                Next::At(at) => self.wait(ping_at.min(at)).await?,
                Next::Nothing => self.wait(ping_at).await?,
            }
        }
    }

    /// Waits for a request, for something to send, for shutdown, or until the given time.
    async fn wait(&mut self, until: Instant) -> Result<(), End> {
        let closing = self.streams.closing.clone();
        let request = tokio::select! {
            request = self.asked.recv() => request,
            () = self.feeds.changed() => None,
            () = closing.cancelled() => None,
            () = sleep_until(until) => None,
        };
        if let Some(request) = request {
            let answer = self.answer(request);
            self.send(answer).await?;
        }
        Ok(())
    }

    /// Handles a request and replies.
    fn answer(&mut self, received: Received) -> Message {
        let request = match received {
            Received::Answer(text) => return Message::text(text),
            Received::Asked(request) => request,
        };
        let text = match request {
            Err(misunderstanding) => ServerText::Error(&misunderstanding).to_json(),
            Ok(Request { id, command: Command::Ping }) => {
                ServerText::Pong { id, clock_ms: self.streams.clock_ms() }.to_json()
            }
            Ok(Request { id, command }) => {
                match command {
                    Command::Subscribe(wanted) => {
                        wanted.into_iter().for_each(|wanted| self.feeds.subscribe(wanted, &self.streams));
                    }
                    Command::Unsubscribe(streams) => {
                        streams.into_iter().for_each(|stream| self.feeds.unsubscribe(stream));
                    }
                    // Stop is executed where it is read.
                    Command::Ping | Command::Stop { .. } => {}
                }
                ServerText::Subscribed { id, streams: self.feeds.subscriptions() }.to_json()
            }
        };
        Message::text(text)
    }

    /// Sends, and counts what the client misses meanwhile.
    async fn send(&mut self, message: Message) -> Result<(), End> {
        let sending = self.to_client.send(message);
        let give_up = sleep_until(Instant::now() + SILENCE_LIMIT);
        tokio::pin!(sending, give_up);
        loop {
            let due = self.feeds.observe_busy(Instant::now());
            let next_due = async {
                match due {
                    Some(due) => sleep_until(due).await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                biased;
                sent = &mut sending => return sent.map_err(|_| End::Gone),
                () = &mut give_up => {
                    return Err(End::Close { code: close::SILENT, reason: "the client does not read" });
                }
                () = next_due => {}
            }
        }
    }
}

fn hello(streams: &Streams) -> Message {
    let limits = Limits {
        max_rate_hz: MAX_RATE_HZ,
        max_client_message_bytes: MAX_CLIENT_MESSAGE_BYTES,
        client_messages_per_s: CLIENT_MESSAGES_PER_S,
    };
    let hello = ServerText::Hello {
        protocol: SUB_PROTOCOL,
        software_version: env!("CARGO_PKG_VERSION"),
        clock_ms: streams.clock_ms(),
        limits,
    };
    Message::text(hello.to_json())
}
