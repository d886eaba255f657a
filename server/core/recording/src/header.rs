//! What a recording is, and how it ended: the metadata around its messages.

use std::collections::BTreeMap;

use capture::{Projector, StageSheet, Target};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::messages::FrameLosses;
use crate::params::FORMAT;

/// The name of the metadata that comes first.
pub(crate) const HEADER: &str = "sheaf.recording";

/// The name of the metadata that comes last.
pub(crate) const END: &str = "sheaf.recording_end";

/// What is known before the first frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingHeader {
    /// What a person calls it.
    pub name: String,
    /// `live` or `scan`.
    pub origin: String,
    /// The scan that was recorded; its name is that of the scan in an exported capture.
    pub scan_id: Option<String>,
    /// The calibration that was active, or that of the scan.
    pub calibration_id: Option<String>,
    /// Version of the program.
    pub software_version: String,
    /// `twin` or `replay` where the devices are none.
    pub simulated: Option<String>,
    /// When it began, wall clock.
    pub started_at_ms: i64,
    /// The board of the station.
    pub target: Target,
    /// What makes the lines.
    pub projector: Projector,
    /// What moves the part.
    pub stage: StageSheet,
}

/// How a recording ended; one without it was broken off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingEnd {
    /// Why, in words.
    pub reason: String,
    /// Frames in it.
    pub n_frames: u64,
    /// Exposures that are not in it, by reason, those after its last frame among them.
    pub lost: FrameLosses,
    /// Messages beside the frames that found no room in their queue.
    pub n_notes_lost: u64,
}

impl RecordingHeader {
    pub(crate) fn to_metadata(&self) -> mcap::write::Metadata {
        let mut texts = texts_of(self);
        texts.insert("format".to_owned(), FORMAT.to_owned());
        mcap::write::Metadata { name: HEADER.to_owned(), metadata: texts }
    }

    pub(crate) fn from_metadata(texts: &BTreeMap<String, String>) -> Result<Self, String> {
        match texts.get("format").map(String::as_str) {
            Some(FORMAT) => value_of(texts),
            Some(other) => Err(format!("its format is {other}, this program reads {FORMAT}")),
            None => Err("it does not say its format".to_owned()),
        }
    }
}

impl RecordingEnd {
    pub(crate) fn to_metadata(&self) -> mcap::write::Metadata {
        mcap::write::Metadata { name: END.to_owned(), metadata: texts_of(self) }
    }

    pub(crate) fn from_metadata(texts: &BTreeMap<String, String>) -> Option<Self> {
        value_of(texts).ok()
    }
}

/// Metadata are texts by names: what is no text is its JSON. What is not known is left out.
fn texts_of(value: &impl Serialize) -> BTreeMap<String, String> {
    let Ok(Value::Object(fields)) = serde_json::to_value(value) else {
        unreachable!("the structs of this module are objects of texts, numbers and their likes")
    };
    let text = |(name, value): (String, Value)| match value {
        Value::Null => None,
        Value::String(text) => Some((name, text)),
        other => Some((name, other.to_string())),
    };
    fields.into_iter().filter_map(text).collect()
}

fn value_of<T: for<'de> Deserialize<'de>>(texts: &BTreeMap<String, String>) -> Result<T, String> {
    // A name that is a number or true is a text all the same: only what must be JSON is read as such.
    let is_text = |name: &str| {
        ["name", "origin", "scan_id", "calibration_id", "software_version", "simulated", "reason"].contains(&name)
    };
    let value = |(name, text): (&String, &String)| {
        let value =
            if is_text(name) { json!(text) } else { serde_json::from_str(text).unwrap_or_else(|_| json!(text)) };
        (name.clone(), value)
    };
    serde_json::from_value(Value::Object(texts.iter().map(value).collect())).map_err(|error| error.to_string())
}
