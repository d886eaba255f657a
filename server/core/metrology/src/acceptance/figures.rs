//! Figures of one position of an artefact.

use serde::{Deserialize, Serialize};

use super::dispersion::Dispersion;
use super::plan::Procedure;

/// Mean residual of one order's points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OrderMean {
    /// Diffraction order.
    pub order: i8,
    /// Its points.
    pub n_points: usize,
    /// Their mean distance from the feature, mm; positive outside or towards the camera.
    pub mean_mm: f64,
}

/// A ball: the free least-squares sphere, all points with equal weight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ball {
    /// Centre, part frame, mm.
    pub centre_mm: [f64; 3],
    /// Diameter, mm.
    pub diameter_mm: f64,
    /// Scatter of the radial distances.
    pub dispersion: Dispersion,
    /// Points on the ball that are not evaluated: near its border, or viewed or lit too steeply.
    pub n_excluded: usize,
    /// By order.
    pub per_order: Vec<OrderMean>,
}

/// A plate: its least-squares plane, all points with equal weight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plate {
    /// Centroid of its points, part frame, mm.
    pub point_mm: [f64; 3],
    /// Unit normal, towards the camera, part frame.
    pub normal: [f64; 3],
    /// Scatter of the distances from the plane.
    pub dispersion: Dispersion,
    /// Points on the plate that are not evaluated: near its border.
    pub n_excluded: usize,
    /// By order.
    pub per_order: Vec<OrderMean>,
}

/// What the cloud of one position gives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "feature", rename_all = "snake_case")]
pub enum Figures {
    /// A ball.
    Ball(Ball),
    /// Two balls.
    Pair {
        /// Distance of the centres, mm.
        distance_mm: f64,
        /// The balls.
        balls: [Ball; 2],
    },
    /// A plate.
    Plate(Plate),
}

/// One position of an artefact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Position {
    /// Which procedure it belongs to.
    pub procedure: Procedure,
    /// Temperature of the artefact, °C, if it was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
    /// Linearity: the height at which the plate was placed, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference_mm: Option<f64>,
    /// Repeatability: RMS of the differences of single points from the first scan, mm; absent for the first scan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference_mm: Option<f64>,
    /// The figures.
    pub figures: Figures,
}
