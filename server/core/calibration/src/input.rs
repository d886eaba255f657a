//! The input of a calibration: features of every image, nominal values, options.

use nalgebra::{Vector2, Vector3};
use optics::{LightModelKind, StagePosition};
use vision::{BoardCorners, Centrelines};

/// The calibration board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardGeometry {
    /// Inner corners along a board row.
    pub inner_columns: usize,
    /// Inner corners along a board column.
    pub inner_rows: usize,
    /// Sides of a square along a board row and a board column.
    pub square_mm: Vector2<f64>,
    /// Its pattern.
    pub pattern: BoardPattern,
}

/// The pattern of a board.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum BoardPattern {
    /// Dark and bright squares.
    #[default]
    Squares,
    /// Markers in the bright squares: laser lines are used on the dark ones only.
    Markers,
    /// Discs, with their centres as corners.
    Circles {
        /// Whether every other row is shifted by a step, and the discs of a row are two steps apart.
        staggered: bool,
        /// Diameter of a disc.
        diameter_mm: f64,
    },
}

impl BoardGeometry {
    /// Middle of the corners on the board, mm from corner (0, 0).
    pub fn centre_mm(&self) -> Vector3<f64> {
        let half = (self.extent_squares() - Vector2::repeat(1.0)) / 2.0;
        Vector3::new(half.x * self.square_mm.x, half.y * self.square_mm.y, 0.0)
    }

    /// Position of an inner corner or of a disc's centre on the board, mm from corner (0, 0).
    pub fn corner_mm(&self, column: usize, row: usize) -> Vector3<f64> {
        let steps = if self.is_staggered() { 2 * column + row % 2 } else { column };
        Vector3::new(steps as f64 * self.square_mm.x, row as f64 * self.square_mm.y, 0.0)
    }

    /// Squares (steps of a circle grid) from corner (0, 0) to the end of the square after the last corner.
    pub fn extent_squares(&self) -> Vector2<f64> {
        let columns = if self.is_staggered() { 2 * self.inner_columns } else { self.inner_columns };
        Vector2::new(columns as f64, self.inner_rows as f64)
    }

    fn is_staggered(&self) -> bool {
        matches!(self.pattern, BoardPattern::Circles { staggered: true, .. })
    }

    /// The field at a position of the board (squares from corner (0, 0)): between nearby positions in the same field
    /// there is no edge.
    pub(crate) fn field(&self, at: Vector2<f64>) -> BoardField {
        let BoardPattern::Circles { staggered, diameter_mm } = self.pattern else {
            // The square beyond corner (0, 0) is dark.
            let (column, row) = (at.x.floor(), at.y.floor());
            let is_bright = (column + row).rem_euclid(2.0) != 0.0;
            return BoardField {
                cell: [column, row],
                holds_marker: self.pattern == BoardPattern::Markers && is_bright,
            };
        };
        let disc = |row: f64| {
            let (first, step) = if staggered { (row.rem_euclid(2.0), 2.0) } else { (0.0, 1.0) };
            [first + step * ((at.x - first) / step).round(), row]
        };
        let is_inside = |[x, y]: &[f64; 2]| {
            Vector2::new(at.x - x, at.y - y).component_mul(&self.square_mm).norm() < diameter_mm / 2.0
        };
        let inside = [disc(at.y.floor()), disc(at.y.ceil())].into_iter().find(is_inside);
        BoardField { cell: inside.unwrap_or([f64::INFINITY; 2]), holds_marker: false }
    }
}

/// A region of the board of one brightness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BoardField {
    /// The square, or the disc; infinite between discs.
    cell: [f64; 2],
    /// Whether a marker is in it.
    pub holds_marker: bool,
}

/// The line projector by its nominal values (data sheets).
#[derive(Debug, Clone, PartialEq)]
pub struct NominalProjector {
    /// The grating; `None` if the lines are independent, each in its own plane.
    pub grating: Option<NominalGrating>,
    /// Orders (without a grating: numbers) of the lines from the top (left) of the image downwards (rightwards);
    /// strictly increasing or decreasing.
    pub orders: Vec<i8>,
}

/// Nominal values of laser and grating (data sheets).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NominalGrating {
    /// Wavelength of the laser.
    pub wavelength_nm: f64,
    /// Grooves per millimetre.
    pub lines_per_mm: f64,
}

impl NominalGrating {
    /// λ/d_g: nm × lines/mm.
    pub fn wavelength_over_period(&self) -> f64 {
        self.wavelength_nm * 1e-6 * self.lines_per_mm
    }
}

/// Features of one board pose, off the stage.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseInput {
    /// Name for reports, such as `board/003.png`.
    pub name: String,
    /// Corners found at normal exposure.
    pub corners: BoardCorners,
    /// Laser lines found at low exposure; `None` if the pose is for the camera alone, or its lines were switched on one
    /// by one.
    pub centrelines: Option<Centrelines>,
    /// The lines of images in which only one line was switched on, see [`Centrelines::lit_line`].
    pub single_line_images: Vec<Centrelines>,
}

impl PoseInput {
    /// Whether there is an image with laser light.
    pub fn has_laser_image(&self) -> bool {
        self.centrelines.is_some() || !self.single_line_images.is_empty()
    }

    /// Its images with laser light.
    pub(crate) fn laser_images(&self) -> impl Iterator<Item = &Centrelines> {
        self.centrelines.iter().chain(&self.single_line_images)
    }
}

/// Features of the board on the stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageViewInput {
    /// Name for reports.
    pub name: String,
    /// Corners.
    pub corners: BoardCorners,
    /// Stage position, as stated by the stage.
    pub position: StagePosition,
}

/// The input of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationInput {
    /// Image width.
    pub width_px: usize,
    /// Image height.
    pub height_px: usize,
    /// The target.
    pub board: BoardGeometry,
    /// The light source.
    pub projector: NominalProjector,
    /// Board poses.
    pub poses: Vec<PoseInput>,
    /// Stage views, all of one kind of stage.
    pub stage_views: Vec<StageViewInput>,
    /// One standard deviation of a turntable's angles, if known.
    pub angle_sigma_deg: Option<f64>,
}

/// Selection of the light model of the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LightModelChoice {
    /// The one recommended by cross-validation.
    #[default]
    Auto,
    /// This one.
    Fixed(LightModelKind),
}

/// Options of a calibration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CalibrationOptions {
    /// Which light model is used in the result.
    pub light_model: LightModelChoice,
    /// Whether k3 is estimated (`true`), fixed at zero (`false`), or decided by its significance (`None`).
    pub estimate_k3: Option<bool>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rows_of_a_staggered_grid_are_offset_by_a_step() {
        let pattern = BoardPattern::Circles { staggered: true, diameter_mm: 12.0 };
        let grid =
            BoardGeometry { inner_columns: 4, inner_rows: 11, square_mm: Vector2::new(15.0, 14.0), pattern };
        assert_eq!(grid.corner_mm(3, 10), Vector3::new(90.0, 140.0, 0.0));
        assert_eq!(grid.corner_mm(3, 9), Vector3::new(105.0, 126.0, 0.0));
        assert_eq!(grid.centre_mm(), Vector3::new(52.5, 70.0, 0.0));
        assert_eq!(grid.extent_squares(), Vector2::new(8.0, 11.0));
    }

    #[test]
    fn each_disc_is_a_separate_field() {
        let pattern = BoardPattern::Circles { staggered: true, diameter_mm: 12.0 };
        let grid = BoardGeometry { inner_columns: 4, inner_rows: 11, square_mm: Vector2::repeat(15.0), pattern };
        let field = |x: f64, y: f64| grid.field(Vector2::new(x, y));
        // The radius is 0.4 steps; odd rows begin a step to the right.
        assert_eq!(field(2.0, 0.0), field(2.35, 0.0));
        assert_ne!(field(2.0, 0.0), field(2.45, 0.0));
        assert_ne!(field(2.0, 0.0), field(4.0, 0.0));
        assert_eq!(field(1.0, 1.0), field(1.0, 1.3));
        assert_eq!(field(1.0, 0.0), field(2.0, 1.0));
        assert!(!field(1.0, 1.0).holds_marker);
    }
}
