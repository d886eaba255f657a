//! What a calibration is made from: features of every picture, the data sheets, the choices.

use nalgebra::{Vector2, Vector3};
use optics::{LightModelKind, StagePosition};
use vision::{BoardCorners, Centrelines, LineDirection};

/// The calibration board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardGeometry {
    /// Inner corners along a board row.
    pub inner_columns: usize,
    /// Inner corners along a board column.
    pub inner_rows: usize,
    /// Sides of a square along a board row and a board column.
    pub square_mm: Vector2<f64>,
    /// Whether the bright squares carry markers: lines are then read on the dark ones alone.
    pub has_markers: bool,
}

impl BoardGeometry {
    /// Middle of the corners on the board, mm from corner (0, 0).
    pub fn centre_mm(&self) -> Vector3<f64> {
        self.corner_mm(self.inner_columns.saturating_sub(1), self.inner_rows.saturating_sub(1)) / 2.0
    }

    /// Place of an inner corner on the board, mm from corner (0, 0).
    pub fn corner_mm(&self, column: usize, row: usize) -> Vector3<f64> {
        Vector3::new(column as f64 * self.square_mm.x, row as f64 * self.square_mm.y, 0.0)
    }
}

/// What makes the lines, by its data sheets.
#[derive(Debug, Clone, PartialEq)]
pub struct ProjectorSheet {
    /// What ties the lines together; `None` if nothing does, so that each has a plane of its own.
    pub grating: Option<GratingSheet>,
    /// Orders (without a grating: numbers) of the lines from the top (left) of the image downwards (rightwards); strictly
    /// rising or falling.
    pub orders: Vec<i8>,
    /// Which way the lines run in the image.
    pub line_direction: LineDirection,
}

/// Laser and grating by their data sheets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GratingSheet {
    /// Wavelength of the laser.
    pub wavelength_nm: f64,
    /// Grooves per millimetre.
    pub lines_per_mm: f64,
}

impl GratingSheet {
    /// λ/d_g: nm × lines/mm.
    pub fn wavelength_over_period(&self) -> f64 {
        self.wavelength_nm * 1e-6 * self.lines_per_mm
    }
}

/// Features of the board at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseInput {
    /// Name for reports, such as `board/003.png`.
    pub name: String,
    /// Corners found at normal exposure.
    pub corners: BoardCorners,
    /// Laser lines found at low exposure; `None` if the pose serves the camera alone.
    pub centrelines: Option<Centrelines>,
}

/// Features of the board carried by the stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageViewInput {
    /// Name for reports.
    pub name: String,
    /// Corners.
    pub corners: BoardCorners,
    /// Where the stage stood, by its own count.
    pub position: StagePosition,
}

/// Everything a calibration is computed from.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationInput {
    /// Image width.
    pub width_px: usize,
    /// Image height.
    pub height_px: usize,
    /// The target.
    pub board: BoardGeometry,
    /// The light source.
    pub projector: ProjectorSheet,
    /// Board poses.
    pub poses: Vec<PoseInput>,
    /// Stage views, all of one kind of stage.
    pub stage_views: Vec<StageViewInput>,
    /// One standard deviation of a turntable's angles, if it is known.
    pub angle_sigma_deg: Option<f64>,
}

/// Which light model goes into the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LightModelChoice {
    /// The one that cross-validation recommends.
    #[default]
    Auto,
    /// This one.
    Fixed(LightModelKind),
}

/// The caller's choices.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CalibrationOptions {
    /// Which light model goes into the result.
    pub light_model: LightModelChoice,
    /// Whether k3 is estimated (`true`), held at zero (`false`), or decided by its significance (`None`).
    pub estimate_k3: Option<bool>,
}
