//! Text messages: JSON objects with `op`.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use station::MachineState;

use crate::protocol::{DEFAULT_RATE_HZ, MAX_RATE_HZ};

/// What can be subscribed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stream {
    /// Pictures with their centrelines.
    Image,
    /// Triangulated points of a frame.
    Profile,
    /// Points of the running scan.
    Points,
    /// The station's state.
    State,
    /// Progress of jobs.
    Jobs,
    /// Number of the newest durable event.
    Events,
}

impl Stream {
    /// Whether a subscription may set a maximum rate.
    pub fn has_rate(self) -> bool {
        matches!(self, Self::Image | Self::Profile | Self::State | Self::Jobs)
    }

    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Image => "image",
            Self::Profile => "profile",
            Self::Points => "points",
            Self::State => "state",
            Self::Jobs => "jobs",
            Self::Events => "events",
        }
    }
}

/// A client message.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Subscribes to streams, or changes subscriptions.
    Subscribe(Vec<Subscription>),
    /// Unsubscribes.
    Unsubscribe(Vec<Stream>),
    /// Requests the clock.
    Ping,
    /// Stops the station.
    Stop {
        /// Who, for the log.
        actor: Option<String>,
    },
}

/// A command and the id for its reply.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Chosen by the client.
    pub id: Option<u64>,
    /// The command.
    pub command: Command,
}

/// A subscription.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Subscription {
    /// Which.
    pub stream: Stream,
    /// At most this often.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_rate_hz: Option<f64>,
    /// Images: downscaling by 1, 2 or 4.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<u8>,
    /// Points: the first block of the running scan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_block: Option<u32>,
}

/// Why a message was not understood; the connection stays.
#[derive(Debug, Clone, PartialEq, Serialize, thiserror::Error)]
#[error("{detail}")]
pub struct Misunderstanding {
    /// A stable code.
    pub code: &'static str,
    /// What is wrong and what would be right.
    pub detail: String,
    /// The id of the message.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
}

/// A server text message.
#[derive(Debug, Serialize)]
#[serde(tag = "op", rename_all = "snake_case")]
pub enum ServerText<'a> {
    /// First message on every connection.
    Hello {
        /// The sub-protocol.
        protocol: &'static str,
        /// Version of the program.
        software_version: &'static str,
        /// The station's clock now; `null` before its first frame.
        clock_ms: Option<f64>,
        /// Limits of a connection.
        limits: Limits,
    },
    /// All current subscriptions.
    Subscribed {
        /// The id of the command.
        #[serde(skip_serializing_if = "Option::is_none")]
        id: Option<u64>,
        /// The streams.
        streams: Vec<Subscription>,
    },
    /// The time.
    Pong {
        /// The id of the command.
        #[serde(skip_serializing_if = "Option::is_none")]
        id: Option<u64>,
        /// The station's clock now; `null` before its first frame.
        clock_ms: Option<f64>,
    },
    /// Result of a Stop.
    Stopped {
        /// The id of the command.
        #[serde(skip_serializing_if = "Option::is_none")]
        id: Option<u64>,
        /// As the response of `POST /api/v1/station/stop`.
        #[serde(flatten)]
        stopped: &'a Value,
    },
    /// A message was not understood.
    Error(&'a Misunderstanding),
    /// The current station, and every change of its state since the last such message.
    State {
        /// Changes, oldest first, numbered without gaps.
        changes: Vec<StateChange>,
        /// As `GET /api/v1/station` returns it.
        station: &'a Value,
    },
    /// A job now.
    Job {
        /// As `GET /api/v1/jobs/{id}` returns it.
        job: &'a Value,
    },
    /// The newest durable event.
    Event {
        /// Its number.
        seq: i64,
    },
    /// A scan with points started or ended.
    Scan {
        /// Which.
        scan_id: &'a str,
        /// Whether more points will come.
        running: bool,
        /// Number of blocks so far; the total once it has ended.
        n_blocks: u32,
        /// Number of the next block on this connection.
        next_block: u32,
    },
    /// Messages dropped since the subscription.
    Dropped {
        /// Per stream.
        streams: Vec<DropCount>,
    },
}

impl ServerText<'_> {
    /// As JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("texts hold no maps with other keys than strings")
    }
}

/// Limits of a connection.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Limits {
    /// Highest rate.
    pub max_rate_hz: f64,
    /// Longest message from the client.
    pub max_client_message_bytes: usize,
    /// Messages from the client per second in the long run.
    pub client_messages_per_s: f64,
}

/// A change of the station's state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateChange {
    /// From 1, without gaps.
    pub number: u64,
    /// The state that was entered, by its OPC 40100-1 name.
    pub state: &'static str,
}

impl From<(u64, MachineState)> for StateChange {
    fn from((number, state): (u64, MachineState)) -> Self {
        Self { number, state: state.name() }
    }
}

/// Message counts of a stream since the subscription: offered = sent + by_rate + too_slow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct DropCount {
    /// Which.
    pub stream: Stream,
    /// Messages available.
    pub offered: u64,
    /// Messages sent.
    pub sent: u64,
    /// Skipped because of the requested rate.
    pub by_rate: u64,
    /// Replaced by newer ones while the client was still reading earlier messages.
    pub too_slow: u64,
}

/// A command as it stands in the message; the `id` is read with the envelope.
#[expect(dead_code, reason = "an id must be a number wherever it may stand")]
#[derive(Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
enum CommandText {
    Subscribe { id: Option<u64>, streams: Vec<SubscriptionText> },
    Unsubscribe { id: Option<u64>, streams: Vec<Stream> },
    Ping { id: Option<u64> },
    Stop { id: Option<u64>, actor: Option<String> },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SubscriptionText {
    stream: Stream,
    max_rate_hz: Option<f64>,
    scale: Option<u8>,
    from_block: Option<u32>,
}

/// The envelope of a message, readable even if the rest is invalid.
#[derive(Deserialize)]
struct Envelope {
    op: Option<Value>,
    id: Option<Value>,
}

/// Reads a text message of a client.
pub fn parse(text: &str) -> Result<Request, Misunderstanding> {
    let refuse = |code, detail: String, id| Misunderstanding { code, detail, id };
    let envelope: Envelope = serde_json::from_str(text).map_err(|error| {
        refuse("bad-json", format!("not a JSON object: {error}; send one object with `op` per message"), None)
    })?;
    let id = envelope.id.as_ref().and_then(Value::as_u64);
    let op = envelope.op.as_ref().and_then(Value::as_str).unwrap_or_default();
    if !["subscribe", "unsubscribe", "ping", "stop"].contains(&op) {
        let detail = format!("unknown op `{}`; known are subscribe, unsubscribe, ping, stop", shortened(op));
        return Err(refuse("unknown-op", detail, id));
    }
    let command: CommandText = serde_json::from_str(text)
        .map_err(|error| refuse("bad-message", format!("{op}: {error}; see openapi/stream.md"), id))?;
    let command = match command {
        CommandText::Ping { .. } => Command::Ping,
        CommandText::Stop { actor, .. } => Command::Stop { actor },
        CommandText::Unsubscribe { streams, .. } => Command::Unsubscribe(streams),
        CommandText::Subscribe { streams, .. } => {
            let accepted: Result<Vec<_>, String> = streams.into_iter().map(accepted).collect();
            Command::Subscribe(accepted.map_err(|detail| refuse("bad-subscription", detail, id))?)
        }
    };
    Ok(Request { id, command })
}

/// A subscription with its defaults, or what is wrong with it.
fn accepted(wanted: SubscriptionText) -> Result<Subscription, String> {
    let name = wanted.stream.name();
    let max_rate_hz = match (wanted.stream.has_rate(), wanted.max_rate_hz) {
        (false, None) => None,
        (false, Some(_)) => {
            return Err(format!("{name} takes no max_rate_hz, because it drops nothing; omit it"));
        }
        (true, rate) => Some(rate.unwrap_or(DEFAULT_RATE_HZ)),
    };
    if max_rate_hz.is_some_and(|rate| !(rate > 0.0 && rate <= MAX_RATE_HZ)) {
        return Err(format!("{name}: max_rate_hz must be above 0 and at most {MAX_RATE_HZ}"));
    }
    let scale = match (wanted.stream, wanted.scale) {
        (Stream::Image, scale) => Some(scale.unwrap_or(1)),
        (_, None) => None,
        (_, Some(_)) => return Err(format!("{name} takes no scale; only image does")),
    };
    if scale.is_some_and(|scale| ![1, 2, 4].contains(&scale)) {
        return Err("image: scale must be 1, 2 or 4".to_owned());
    }
    if wanted.from_block.is_some() && wanted.stream != Stream::Points {
        return Err(format!("{name} takes no from_block; only points does"));
    }
    Ok(Subscription { stream: wanted.stream, max_rate_hz, scale, from_block: wanted.from_block })
}

/// What a client sent, short enough to be sent back.
fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn subscribed(text: &str) -> Subscription {
        match parse(text).unwrap().command {
            Command::Subscribe(streams) => streams[0].clone(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_subscription_gets_its_defaults() {
        let image = subscribed(r#"{"op":"subscribe","streams":[{"stream":"image"}]}"#);
        assert_eq!((image.max_rate_hz, image.scale), (Some(DEFAULT_RATE_HZ), Some(1)));
        let points = subscribed(r#"{"op":"subscribe","streams":[{"stream":"points","from_block":7}]}"#);
        assert_eq!((points.max_rate_hz, points.from_block), (None, Some(7)));
    }

    #[test]
    fn errors_name_the_field() {
        let cases = [
            ("[1]", "bad-json"),
            ("{\"op\":", "bad-json"),
            ("{}", "unknown-op"),
            (r#"{"op":"dance"}"#, "unknown-op"),
            (r#"{"op":"ping","id":-1}"#, "bad-message"),
            (r#"{"op":"subscribe"}"#, "bad-message"),
            (r#"{"op":"subscribe","streams":[{"stream":"sound"}]}"#, "bad-message"),
            (r#"{"op":"subscribe","streams":[{"stream":"image","rate":3}]}"#, "bad-message"),
            (r#"{"op":"subscribe","streams":[{"stream":"image","max_rate_hz":0}]}"#, "bad-subscription"),
            (r#"{"op":"subscribe","streams":[{"stream":"image","max_rate_hz":241}]}"#, "bad-subscription"),
            (r#"{"op":"subscribe","streams":[{"stream":"image","scale":3}]}"#, "bad-subscription"),
            (r#"{"op":"subscribe","streams":[{"stream":"points","max_rate_hz":3}]}"#, "bad-subscription"),
            (r#"{"op":"subscribe","streams":[{"stream":"profile","scale":2}]}"#, "bad-subscription"),
            (r#"{"op":"subscribe","streams":[{"stream":"state","from_block":2}]}"#, "bad-subscription"),
            (r#"{"op":"unsubscribe","streams":["sound"]}"#, "bad-message"),
        ];
        for (text, code) in cases {
            assert_eq!(parse(text).unwrap_err().code, code, "{text}");
        }
    }

    #[test]
    fn an_error_carries_the_number_of_the_message() {
        let error = parse(r#"{"op":"dance","id":12}"#).unwrap_err();
        let text: serde_json::Value = serde_json::from_str(&ServerText::Error(&error).to_json()).unwrap();
        assert_eq!((text["op"].as_str(), text["id"].as_u64()), (Some("error"), Some(12)));
    }

    #[test]
    fn deeply_nested_and_malformed_json_is_refused() {
        for text in ["[".repeat(10_000), format!("{{\"op\":{}", "{\"a\":".repeat(5000)), "\u{0}".into()] {
            assert_eq!(parse(&text).unwrap_err().code, "bad-json");
        }
    }
}
