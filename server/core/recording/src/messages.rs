//! The messages that are JSON: their types are their schemas.

use std::collections::BTreeMap;

use capture::StagePlace;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::topics::Topic;

/// A message in JSON with a schema of its own.
pub trait JsonMessage: Serialize + JsonSchema {
    /// Where it goes.
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

/// Where the stage stood; neither is there where that is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Place {
    /// Position of a linear stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// Angle of a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
}

impl From<StagePlace> for Place {
    fn from(place: StagePlace) -> Self {
        match place {
            StagePlace::PositionMm(position_mm) => Self { position_mm: Some(position_mm), angle_deg: None },
            StagePlace::AngleDeg(angle_deg) => Self { position_mm: None, angle_deg: Some(angle_deg) },
        }
    }
}

impl Place {
    /// As the capture folder says it; `None` is unknown.
    pub fn known(self) -> Option<StagePlace> {
        self.position_mm.map(StagePlace::PositionMm).or(self.angle_deg.map(StagePlace::AngleDeg))
    }
}

/// What belongs to a picture; the picture with the same log time is its own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrameNote {
    /// The station's count of frames that arrived.
    pub sequence: u64,
    /// The middle of the exposure by the station's monotonic clock, ns.
    pub captured_at_ns: u64,
    /// Where the stage stood in the middle of the exposure.
    #[serde(flatten)]
    pub place: Place,
    /// How long the sensor collected light, µs; 0 is unknown.
    pub exposure_us: f64,
    /// Whether the laser was on.
    pub laser_on: bool,
    /// Exposures between the recorded frame before and this one that are not in the file.
    pub lost_before: FrameLosses,
}

/// Exposures that are not in the file, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct FrameLosses {
    /// Lost between sensor and driver.
    pub camera: u64,
    /// Packets of them were missing.
    pub incomplete: u64,
    /// There was no free buffer.
    pub no_buffer: u64,
    /// They came with another size or format.
    pub malformed: u64,
    /// They arrived, and the recorder did not take them in time.
    pub recorder: u64,
}

impl FrameLosses {
    /// Reasons and counts.
    pub fn by_reason(&self) -> [(&'static str, u64); 5] {
        [
            ("camera", self.camera),
            ("incomplete", self.incomplete),
            ("no_buffer", self.no_buffer),
            ("malformed", self.malformed),
            ("recorder", self.recorder),
        ]
    }

    /// All together.
    pub fn total(&self) -> u64 {
        self.by_reason().iter().map(|(_, n)| n).sum()
    }

    /// Adds others.
    pub fn add(&mut self, other: &Self) {
        self.camera += other.camera;
        self.incomplete += other.incomplete;
        self.no_buffer += other.no_buffer;
        self.malformed += other.malformed;
        self.recorder += other.recorder;
    }
}

/// The stage between frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StageNote {
    /// Where it stands.
    #[serde(flatten)]
    pub place: Place,
    /// Whether it moves.
    pub moving: bool,
    /// Whether its zero is established.
    pub homed: bool,
}

/// A frame that is a row of the recorded scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RowNote {
    /// The frame's sequence.
    pub sequence: u64,
    /// Which row, from 0.
    pub row: u64,
    /// Where the scan takes it to be.
    #[serde(flatten)]
    pub place: Place,
}

/// The devices and how they are set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SettingsNote {
    /// The camera.
    pub camera: DeviceNote,
    /// The stage.
    pub stage: DeviceNote,
    /// The laser.
    pub laser: DeviceNote,
}

/// A device and how it is set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DeviceNote {
    /// Whether it answers.
    pub connected: bool,
    /// Its driver.
    pub driver: String,
    /// Who made it.
    pub vendor: String,
    /// Which model.
    pub model: String,
    /// Which one of them.
    pub serial: String,
    /// Version of its firmware.
    pub firmware: String,
    /// Its settings, each name with its unit.
    pub settings: BTreeMap<String, Value>,
}

/// Something that happened, as the service logs it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EventNote {
    /// What, such as `live.started`.
    pub kind: String,
    /// To what.
    pub subject: String,
    /// What else is known about it.
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

/// A point of a profile in the camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePoint {
    /// Where it is, mm.
    pub position_mm: [f64; 3],
    /// The order of its light sheet.
    pub order: i8,
    /// Standard deviation along the ray, mm.
    pub sigma_mm: f32,
}
