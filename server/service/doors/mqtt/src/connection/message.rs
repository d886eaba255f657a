//! What is published.

use serde_json::Value;

/// Content type of JSON.
const JSON: &str = "application/json";

/// A message to publish with QoS 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Where.
    pub topic: String,
    /// What.
    pub payload: Vec<u8>,
    /// Its content type; `None`: no text.
    pub content_type: Option<&'static str>,
    /// Whether the broker keeps it for later subscribers.
    pub retained: bool,
    /// After which the broker drops it.
    pub expiry_s: Option<u32>,
    /// What the client that is answered gave for it.
    pub correlation: Option<Vec<u8>>,
}

impl Message {
    /// JSON for the subscribers of now.
    pub fn json(topic: String, payload: &Value, expiry_s: Option<u32>) -> Self {
        Self { expiry_s, content_type: Some(JSON), ..Self::binary(topic, payload.to_string().into_bytes()) }
    }

    /// Bytes for the subscribers of now.
    pub fn binary(topic: String, payload: Vec<u8>) -> Self {
        Self { topic, payload, content_type: None, retained: false, expiry_s: None, correlation: None }
    }
}

/// The last message of a connection that breaks, by its number.
pub type Will = Box<dyn Fn(u64) -> Message + Send + Sync>;
