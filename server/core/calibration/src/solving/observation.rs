//! Observations of the fits: corners in board coordinates, labelled laser points, each with its σ.

use nalgebra::{Vector2, Vector3};

/// One board corner observed in one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerObservation {
    /// Position on the board, mm, z = 0.
    pub board_mm: Vector3<f64>,
    /// Observed raw pixel.
    pub pixel: Vector2<f64>,
    /// σ per axis.
    pub sigma_px: f64,
}

/// One image of the board.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerView {
    /// Index of the pose block.
    pub block: usize,
    /// Travel of the stage since the block's pose, mm; 0 for a board at rest.
    pub travel_mm: f64,
    /// The corners.
    pub corners: Vec<CornerObservation>,
}

/// One labelled centreline point on the board of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaserObservation {
    /// Index of the pose block.
    pub block: usize,
    /// Order of its line.
    pub order: i8,
    /// Observed raw pixel.
    pub pixel: Vector2<f64>,
    /// σ across the line of the point itself.
    pub sigma_px: f64,
    /// Number of independent points that this one represents: column spacing of the points over the noise's correlation
    /// length, at most 1.
    pub effective_weight: f64,
}

/// Huber's ρ and weight at `z` standard deviations: quadratic to `limit`, linear beyond.
pub fn huber(z: f64, limit: f64) -> (f64, f64) {
    if z <= limit { (0.5 * z * z, 1.0) } else { (limit * (z - 0.5 * limit), limit / z) }
}
