//! The serialised form of a calibration: named entries with units.

use serde::{Deserialize, Serialize};

/// Camera by OpenCV's convention.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct CameraText {
    pub width_px: usize,
    pub height_px: usize,
    pub fx_px: f64,
    pub fy_px: f64,
    pub cx_px: f64,
    pub cy_px: f64,
    pub k1: f64,
    pub k2: f64,
    pub p1: f64,
    pub p2: f64,
    pub k3: f64,
}

/// Light sheets of one model, camera frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum LightText {
    /// n·X + d = 0 per order.
    Planes { planes: Vec<PlaneText> },
    /// Planes through one line.
    Pencil { point_mm: [f64; 3], direction: [f64; 3], base_normal: [f64; 3], wavelength_over_period: f64 },
    /// The exact sheets.
    Grating {
        source_mm: [f64; 3],
        axis: [f64; 3],
        fan: [f64; 3],
        normal: [f64; 3],
        groove: [f64; 3],
        gap_mm: f64,
        wavelength_over_period: f64,
    },
}

/// One plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct PlaneText {
    pub order: i8,
    pub normal: [f64; 3],
    pub offset_mm: f64,
}

/// The stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum StageText {
    /// A linear stage.
    Linear(TravelText),
    /// A turntable.
    Rotary(AxisText),
}

/// Axis of a turntable, camera frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisText {
    /// Always `rotary`.
    pub kind: RotaryTag,
    /// A point of the axis.
    pub point_mm: [f64; 3],
    /// Unit vector about which increasing angles rotate the part by the right-hand rule.
    pub direction: [f64; 3],
    /// Standard deviation of the table's angles; absent if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_sigma_deg: Option<f64>,
}

/// Distinguishes a turntable from a linear stage, which has no `kind`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RotaryTag {
    /// A turntable.
    Rotary,
}

/// Travel of a linear stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TravelText {
    /// Camera-frame millimetres per millimetre of nominal travel.
    pub direction_mm_per_mm: [f64; 3],
    /// Straightness of the travel; absent if unknown, as in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub straightness: Option<StraightnessText>,
    /// Pitch, yaw and roll of the travel; absent if unknown, as in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tilt: Option<TiltText>,
}

/// Deviations from straight and uniform travel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StraightnessText {
    /// One standard deviation along every axis.
    pub sigma_mm: f64,
    /// Stage position of the first node.
    pub first_mm: f64,
    /// Stage position of the last node.
    pub last_mm: f64,
    /// Nodes, evenly spaced.
    pub n_nodes: usize,
}

/// Rotations of the carriage: pitch, yaw and roll.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TiltText {
    /// Three independent rotation vectors of one standard deviation, camera frame.
    pub sigmas_rad: [[f64; 3]; 3],
    /// Centre of the rotations at the middle of the nodes, camera frame.
    pub centre_mm: [f64; 3],
    /// Stage position of the first node.
    pub first_mm: f64,
    /// Stage position of the last node.
    pub last_mm: f64,
    /// Nodes, evenly spaced.
    pub n_nodes: usize,
}

/// Joint covariance of all parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CovarianceText {
    /// Names of rows and columns: camera, light (local steps, see the maths), stage.
    pub parameters: Vec<String>,
    /// Rows.
    pub matrix: Vec<Vec<f64>>,
}

/// Depth range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct DepthRangeText {
    pub near_mm: f64,
    pub far_mm: f64,
}

/// Everything needed to use the calibration; small enough for a cloud's header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationText {
    /// Always [`super::FORMAT`].
    pub format: String,
    /// First digits of the whole document's SHA-256, computed with an empty id.
    pub id: String,
    /// Camera.
    pub camera: CameraText,
    /// Orders from the top (left) of the image downwards (rightwards).
    pub orders: Vec<i8>,
    /// Light sheets.
    pub light: LightText,
    /// Stage, if calibrated.
    pub stage: Option<StageText>,
    /// Depth range.
    pub depth_range: DepthRangeText,
    /// Joint covariance.
    pub covariance: CovarianceText,
}
