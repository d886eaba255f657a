//! `capture.json`: the manifest of a capture folder.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vision::{GreyImage, LineDirection};

use crate::image_file::ImageFileError;

/// The manifest's text form; see `server/docs/schemas/capture.schema.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Always `sheaf-capture/1`.
    pub format: String,
    /// Size of every image.
    pub camera: CameraFormat,
    /// The calibration target.
    pub target: BoardTarget,
    /// Laser and grating.
    pub projector: Projector,
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

/// Size of every image of the capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraFormat {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
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
}

/// A validated capture folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// The folder.
    pub folder: PathBuf,
    /// Its manifest, validated.
    pub manifest: Manifest,
    /// Unknown keys and other oddities that were ignored, in words for the operator.
    pub warnings: Vec<String>,
}
