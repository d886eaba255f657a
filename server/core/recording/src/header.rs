//! Header and end of a recording: the metadata around its messages.

use std::collections::BTreeMap;

use capture::{Projector, StageDescription, Target};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::messages::FrameLosses;
use crate::params::FORMAT;

/// Name of the first metadata record.
pub(crate) const HEADER: &str = "sheaf.recording";

/// Name of the last metadata record.
pub(crate) const END: &str = "sheaf.recording_end";

/// Data known before the first frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingHeader {
    /// Name given by the operator.
    pub name: String,
    /// `live` or `scan`.
    pub origin: String,
    /// The scan that was recorded; its name is that of the scan in an exported capture.
    pub scan_id: Option<String>,
    /// The calibration that was active, or that of the scan.
    pub calibration_id: Option<String>,
    /// Version of the program.
    pub software_version: String,
    /// `twin` or `replay` if the devices are simulated.
    pub simulated: Option<String>,
    /// Start time, wall clock.
    pub started_at_ms: i64,
    /// The board of the station.
    pub target: Target,
    /// The line projector.
    pub projector: Projector,
    /// The stage.
    pub stage: StageDescription,
}

/// How a recording ended; one without it was interrupted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingEnd {
    /// The reason.
    pub reason: String,
    /// Frames in it.
    pub n_frames: u64,
    /// Missing exposures, by reason, including those after its last frame.
    pub lost: FrameLosses,
    /// Messages other than frames that were dropped because their queue was full.
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
            None => Err("its format is not stated".to_owned()),
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

/// Metadata are strings by name: values other than strings are stored as JSON. Unknown values are omitted.
fn texts_of(value: &impl Serialize) -> BTreeMap<String, String> {
    let Ok(Value::Object(fields)) = serde_json::to_value(value) else {
        unreachable!("the structs of this module serialize to JSON objects")
    };
    let text = |(name, value): (String, Value)| match value {
        Value::Null => None,
        Value::String(text) => Some((name, text)),
        other => Some((name, other.to_string())),
    };
    fields.into_iter().filter_map(text).collect()
}

fn value_of<T: for<'de> Deserialize<'de>>(texts: &BTreeMap<String, String>) -> Result<T, String> {
    // A name that looks like a number or `true` is still a string: only the other fields are parsed as JSON.
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
