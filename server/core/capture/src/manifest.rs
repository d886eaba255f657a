//! `capture.json`: the manifest of a capture folder.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::channel::ChannelChoice;
use crate::projector::Projector;
use crate::stage::{StagePlace, StageSheet, number};
use crate::target::Target;

/// The manifest's text form; see `server/docs/schemas/capture.schema.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Always `sheaf-capture/1`.
    pub format: String,
    /// Size of every image, and its channel.
    pub camera: CameraFormat,
    /// The calibration target.
    pub target: Target,
    /// What makes the lines.
    pub projector: Projector,
    /// What moves the part.
    #[serde(default, skip_serializing_if = "StageSheet::is_default")]
    pub stage: StageSheet,
    /// A picture with the laser off for everything that has none of its own; only if nothing in it moves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<PathBuf>,
    /// The board at rest, seen by normal light and by laser light.
    #[serde(default)]
    pub poses: Vec<Pose>,
    /// The board carried by the stage.
    #[serde(default)]
    pub stage_views: Vec<StageView>,
    /// Scans of objects.
    #[serde(default)]
    pub scans: Vec<Scan>,
}

/// Size of every image of the capture, and what is looked at of those in colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraFormat {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// The channel in which colour pictures show the laser.
    #[serde(default, skip_serializing_if = "ChannelChoice::is_auto")]
    pub channel: ChannelChoice,
}

/// One board pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Image at normal exposure.
    pub board: PathBuf,
    /// Image at low exposure with the laser on; without it the pose serves the camera alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser: Option<PathBuf>,
    /// Lines that are lit one by one: in place of `laser` one such image per line, in the order of their numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lasers: Vec<PathBuf>,
    /// The same as `laser` or `lasers` with the laser off, to be taken away from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<PathBuf>,
}

/// The board at a known stage position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageView {
    /// Image at normal exposure.
    pub board: PathBuf,
    /// Nominal position of a linear stage.
    #[serde(default, deserialize_with = "number", skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// Nominal angle of a turntable.
    #[serde(default, deserialize_with = "number", skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
}

/// A scan: frames of laser lines on an object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Unique name.
    pub name: String,
    /// In order of capture.
    pub frames: Vec<Frame>,
}

/// One frame of a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// The image.
    pub image: PathBuf,
    /// Nominal position of a linear stage.
    #[serde(default, deserialize_with = "number", skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// Nominal angle of a turntable.
    #[serde(default, deserialize_with = "number", skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// The same as `image` with the laser off, to be taken away from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<PathBuf>,
    /// Lines that are lit one by one: which was lit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<i8>,
}

impl StageView {
    /// The board seen while the stage stood there.
    pub fn new(board: impl Into<PathBuf>, place: StagePlace) -> Self {
        let (position_mm, angle_deg) = place.keys();
        Self { board: board.into(), position_mm, angle_deg }
    }

    /// Where the stage stood; a manifest that was read or written has one of the two keys.
    pub fn place(&self) -> StagePlace {
        StagePlace::of_keys(self.position_mm, self.angle_deg)
    }
}

impl Frame {
    /// A frame, taken while the stage stood there, without a background of its own.
    pub fn new(image: impl Into<PathBuf>, place: StagePlace) -> Self {
        let (position_mm, angle_deg) = place.keys();
        Self { image: image.into(), position_mm, angle_deg, background: None, line: None }
    }

    /// Where the stage stood; a manifest that was read or written has one of the two keys.
    pub fn place(&self) -> StagePlace {
        StagePlace::of_keys(self.position_mm, self.angle_deg)
    }
}
