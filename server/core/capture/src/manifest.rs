//! `capture.json`: the manifest of a capture folder.

use std::num::NonZeroU16;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::channel::ChannelChoice;
use crate::projector::Projector;
use crate::stage::{NominalPosition, StageDescription, number};
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
    /// The line projector.
    pub projector: Projector,
    /// The stage.
    #[serde(default, skip_serializing_if = "StageDescription::is_default")]
    pub stage: StageDescription,
    /// A background (laser off) for all images without their own; only for static scenes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<PathBuf>,
    /// The board at rest, in ambient light and in laser light.
    #[serde(default)]
    pub poses: Vec<Pose>,
    /// The board on the stage.
    #[serde(default)]
    pub stage_views: Vec<StageView>,
    /// Scans of objects.
    #[serde(default)]
    pub scans: Vec<Scan>,
}

/// Size of every image of the capture, the channel used of colour images and the white level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraFormat {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// The channel in which colour images show the laser.
    #[serde(default, skip_serializing_if = "ChannelChoice::is_auto")]
    pub channel: ChannelChoice,
    /// The grey level of a saturated pixel in images of 16 bits; by default that of a sensor with the bits they use.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub white_level: Option<NonZeroU16>,
}

impl CameraFormat {
    /// Of this size; channel and white level are determined from the images.
    pub fn of_size(width_px: usize, height_px: usize) -> Self {
        Self { width_px, height_px, channel: ChannelChoice::Auto, white_level: None }
    }
}

/// One board pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Image at normal exposure.
    pub board: PathBuf,
    /// Image at low exposure with the laser on; without it the pose is used for the camera only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser: Option<PathBuf>,
    /// If lines are switched on one by one: instead of `laser` one such image per line, in the order of their numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lasers: Vec<PathBuf>,
    /// The background of `laser` or `lasers`: the same view with the laser off, to be subtracted.
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
    /// The background of `image`: the same view with the laser off, to be subtracted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<PathBuf>,
    /// If lines are switched on one by one: the line that was on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<i8>,
}

impl StageView {
    /// A view of the board at a stage position.
    pub fn new(board: impl Into<PathBuf>, position: NominalPosition) -> Self {
        let (position_mm, angle_deg) = position.keys();
        Self { board: board.into(), position_mm, angle_deg }
    }

    /// The stage position; a manifest that was read or written has exactly one of the two keys.
    pub fn position(&self) -> NominalPosition {
        NominalPosition::of_keys(self.position_mm, self.angle_deg)
    }
}

impl Frame {
    /// A frame at a stage position, without a background of its own.
    pub fn new(image: impl Into<PathBuf>, position: NominalPosition) -> Self {
        let (position_mm, angle_deg) = position.keys();
        Self { image: image.into(), position_mm, angle_deg, background: None, line: None }
    }

    /// The stage position; a manifest that was read or written has exactly one of the two keys.
    pub fn position(&self) -> NominalPosition {
        NominalPosition::of_keys(self.position_mm, self.angle_deg)
    }
}
