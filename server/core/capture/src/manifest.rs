//! `capture.json`: the manifest of a capture folder.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use vision::LineDirection;

use crate::channel::ChannelChoice;

/// How `projector.line_direction` says that the lines run along image columns.
pub(crate) const COLUMNS: &str = "columns";

/// How `projector.line_direction` says that the lines run along image rows.
pub(crate) const ROWS: &str = "rows";

/// The manifest's text form; see `server/docs/schemas/capture.schema.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Always `sheaf-capture/1`.
    pub format: String,
    /// Size of every image, and its channel.
    pub camera: CameraFormat,
    /// The calibration target.
    pub target: BoardTarget,
    /// Laser and grating.
    pub projector: Projector,
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

/// A chessboard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoardTarget {
    /// `chessboard`.
    pub kind: String,
    /// Inner corners along a board row.
    pub inner_columns: usize,
    /// Inner corners along a board column.
    pub inner_rows: usize,
    /// Side of a square.
    pub square_mm: f64,
}

/// Laser and grating by their data sheets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Projector {
    /// Wavelength of the laser.
    pub wavelength_nm: f64,
    /// Grooves per millimetre.
    pub grating_lines_per_mm: f64,
    /// Orders from the top (left) of the image downwards (rightwards).
    pub orders: Vec<i8>,
    /// `rows` (default) or `columns`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line_direction: Option<String>,
}

/// One board pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Image at normal exposure.
    pub board: PathBuf,
    /// Image at low exposure with the laser on; without it the pose serves the camera alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser: Option<PathBuf>,
    /// The same as `laser` with the laser off, to be taken away from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<PathBuf>,
}

/// The board at a known stage position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageView {
    /// Image at normal exposure.
    pub board: PathBuf,
    /// Nominal position.
    pub position_mm: f64,
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
    /// Nominal stage position at exposure.
    pub position_mm: f64,
    /// The same as `image` with the laser off, to be taken away from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<PathBuf>,
}

impl Manifest {
    /// Which way the lines run across the image; along rows unless the projector says otherwise.
    pub fn line_direction(&self) -> LineDirection {
        self.projector.direction()
    }
}

impl Projector {
    /// Which way the lines run in the images.
    pub fn direction(&self) -> LineDirection {
        match self.line_direction.as_deref() {
            Some(COLUMNS) => LineDirection::Columns,
            _ => LineDirection::Rows,
        }
    }

    /// λ/d_g, the sine by which neighbouring orders part at normal incidence.
    pub fn wavelength_over_period(&self) -> f64 {
        self.wavelength_nm * 1e-6 * self.grating_lines_per_mm
    }

    /// The manifest's word for a line direction: nothing for rows, the default.
    pub fn word_for(direction: LineDirection) -> Option<String> {
        (direction == LineDirection::Columns).then(|| COLUMNS.to_owned())
    }
}
