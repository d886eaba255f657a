//! The JSON messages: their types define their schemas.

use std::collections::BTreeMap;

use capture::NominalPosition;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::topics::Topic;

/// A message in JSON with a schema of its own.
pub trait JsonMessage: Serialize + JsonSchema {
    /// Its topic.
    const TOPIC: Topic;
    /// The name of its schema.
    const SCHEMA: &'static str;
}

macro_rules! json_message {
    ($message:ty, $topic:ident, $schema:literal) => {
        impl JsonMessage for $message {
            const TOPIC: Topic = Topic::$topic;
            const SCHEMA: &'static str = $schema;
        }
    };
}

json_message!(FrameNote, Frame, "sheaf.Frame");
json_message!(PeaksNote, Peaks, "sheaf.Peaks");
json_message!(StageNote, Stage, "sheaf.Stage");
json_message!(RowNote, Row, "sheaf.ScanRow");
json_message!(SettingsNote, Settings, "sheaf.DeviceSettings");
json_message!(EventNote, Event, "sheaf.Event");

/// A stage position; both values are missing if it is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct RecordedPosition {
    /// Position of a linear stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// Angle of a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
}

impl From<NominalPosition> for RecordedPosition {
    fn from(position: NominalPosition) -> Self {
        match position {
            NominalPosition::PositionMm(position_mm) => Self { position_mm: Some(position_mm), angle_deg: None },
            NominalPosition::AngleDeg(angle_deg) => Self { position_mm: None, angle_deg: Some(angle_deg) },
        }
    }
}

impl RecordedPosition {
    /// As in a capture folder; `None` if unknown.
    pub fn known(self) -> Option<NominalPosition> {
        self.position_mm.map(NominalPosition::PositionMm).or(self.angle_deg.map(NominalPosition::AngleDeg))
    }
}

/// Metadata of the image with the same log time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrameNote {
    /// The station's sequence number of the frame.
    pub sequence: u64,
    /// The middle of the exposure by the station's monotonic clock, ns.
    pub captured_at_ns: u64,
    /// Stage position in the middle of the exposure.
    #[serde(flatten)]
    pub position: RecordedPosition,
    /// Exposure time, µs; 0 if unknown.
    pub exposure_us: f64,
    /// Whether the laser was on.
    pub laser_on: bool,
    /// Missing exposures between the previous recorded frame and this one.
    pub lost_before: FrameLosses,
}

/// Missing exposures, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct FrameLosses {
    /// Lost between sensor and driver.
    pub camera: u64,
    /// Incomplete: packets were missing.
    pub incomplete: u64,
    /// No free buffer.
    pub no_buffer: u64,
    /// Another size or format.
    pub malformed: u64,
    /// Received, but not taken by the recorder in time.
    pub recorder: u64,
}

impl FrameLosses {
    /// Names and counts.
    pub fn by_reason(&self) -> [(&'static str, u64); 5] {
        [
            ("camera", self.camera),
            ("incomplete", self.incomplete),
            ("no_buffer", self.no_buffer),
            ("malformed", self.malformed),
            ("recorder", self.recorder),
        ]
    }

    /// Sum.
    pub fn total(&self) -> u64 {
        self.by_reason().iter().map(|(_, n)| n).sum()
    }

    /// Adds the counts of another frame or file.
    pub fn add(&mut self, other: &Self) {
        self.camera += other.camera;
        self.incomplete += other.incomplete;
        self.no_buffer += other.no_buffer;
        self.malformed += other.malformed;
        self.recorder += other.recorder;
    }
}

/// State of the stage between frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StageNote {
    /// Its position.
    #[serde(flatten)]
    pub position: RecordedPosition,
    /// Whether it is moving.
    pub moving: bool,
    /// Whether it is homed.
    pub homed: bool,
}

/// A frame that is a row of the recorded scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RowNote {
    /// The frame's sequence.
    pub sequence: u64,
    /// Index of the row.
    pub row: u64,
    /// Position assigned by the scan.
    #[serde(flatten)]
    pub position: RecordedPosition,
}

/// The devices and their settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SettingsNote {
    /// The camera.
    pub camera: DeviceNote,
    /// The stage.
    pub stage: DeviceNote,
    /// The laser.
    pub laser: DeviceNote,
}

/// A device and its settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DeviceNote {
    /// Whether it is connected.
    pub connected: bool,
    /// Its driver.
    pub driver: String,
    /// Its vendor.
    pub vendor: String,
    /// Its model.
    pub model: String,
    /// Its serial number.
    pub serial: String,
    /// Version of its firmware.
    pub firmware: String,
    /// Its settings, each name with its unit.
    pub settings: BTreeMap<String, Value>,
}

/// An event, as logged by the service.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EventNote {
    /// Its kind, such as `live.started`.
    pub kind: String,
    /// Its subject.
    pub subject: String,
    /// Further data.
    pub body: Value,
}

/// The centrelines of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PeaksNote {
    /// The frame's sequence.
    pub sequence: u64,
    /// Its lines, in raw sensor pixels.
    pub lines: Vec<PeakLine>,
}

/// A connected piece of a line; all lists have the same length.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct PeakLine {
    /// Columns, px.
    pub u_px: Vec<f32>,
    /// Rows, px.
    pub v_px: Vec<f32>,
    /// Standard deviation across the line, px.
    pub sigma_px: Vec<f32>,
    /// Grey levels above the background.
    pub intensity: Vec<f32>,
}

/// A point of a profile in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePoint {
    /// Position, mm.
    pub position_mm: [f64; 3],
    /// The order of its light sheet.
    pub order: i8,
    /// Standard deviation along the ray, mm.
    pub sigma_mm: f32,
}
