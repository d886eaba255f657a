//! The figures of a calibration on the wire, as lists carry them: read from the record.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Figures of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CalibrationSummaryDto {
    /// RMS distance of board corners from where the camera expects them.
    pub corner_rms_px: f64,
    /// Standard deviation of a corner per axis, as estimated from the residuals.
    pub corner_sigma_px: f64,
    /// Why the sixth-power distortion was estimated or not, in a sentence.
    pub k3_reason: String,
    /// Parameters of the camera by name: `fx`, `fy`, `cx`, `cy`, `k1`, …
    pub camera: BTreeMap<String, EstimateDto>,
    /// The board pictures.
    pub pictures: Vec<PictureFitDto>,
    /// Model of the light sheets; missing without laser pictures: such a calibration cannot scan.
    pub model: Option<LightModelNameDto>,
    /// RMS distance of laser points from their predicted curves.
    pub light_rms_px: Option<f64>,
    /// What the calibration leaves of depth uncertainty over the working volume.
    pub systematic_sigma_mm: Option<f64>,
    /// The light models compared; missing with too few poses.
    pub models: Option<ModelComparisonDto>,
    /// Board poses.
    pub n_poses: usize,
    /// Of them with a laser picture.
    pub n_laser_poses: usize,
    /// Board pictures on the moving stage.
    pub n_stage_views: usize,
    /// z of the camera frame at which the board was seen nearest.
    pub depth_near_mm: f64,
    /// z of the camera frame at which the board was seen farthest.
    pub depth_far_mm: f64,
    /// The stage; missing if it was not calibrated.
    pub stage: Option<StageFiguresDto>,
    /// The axis of a turntable; missing without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<AxisFiguresDto>,
    /// What to know about it, in sentences.
    pub warnings: Vec<String>,
    /// Pictures that were left out, in sentences.
    pub left_out: Vec<String>,
}

/// A value with its standard deviation; 0 for one that was held.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EstimateDto {
    /// The value.
    pub value: f64,
    /// σ.
    pub sigma: f64,
}

/// How a board picture fits the camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PictureFitDto {
    /// The picture.
    pub picture: String,
    /// RMS distance of its corners from where the camera expects them.
    pub rms_px: f64,
    /// Its corners.
    pub n_corners: usize,
}

/// A model of the light sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightModelNameDto {
    /// One free plane per order.
    Planes,
    /// Planes through one line at the angles of the grating equation.
    Pencil,
    /// The exact curved sheets of the vector grating equation.
    Grating,
}

/// The light models, compared on poses that were left out of their fits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ModelComparisonDto {
    /// One per model, simplest first.
    pub scores: Vec<ModelScoreDto>,
    /// The one with evidence on its side.
    pub recommended: LightModelNameDto,
    /// Why, in a sentence.
    pub reason: String,
}

/// Error of one light model on poses that were left out of its fit; missing where it could not be fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ModelScoreDto {
    /// The model.
    pub model: LightModelNameDto,
    /// RMS distance of held-out points from the predicted curves.
    pub held_out_rms_px: Option<f64>,
    /// The same as depth, along the camera ray.
    pub held_out_rms_mm: Option<f64>,
    /// The part of it that is common to the points of a pose and order.
    pub held_out_bias_mm: Option<f64>,
    /// RMS on the poses used for the fit.
    pub fit_rms_px: Option<f64>,
    /// Why it could not be fitted, if so.
    pub failure: Option<String>,
}

/// The axis of a turntable as calibrated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AxisFiguresDto {
    /// A point of the axis, camera frame.
    #[schema(min_items = 3, max_items = 3)]
    pub point_mm: [f64; 3],
    /// Unit vector about which growing angles turn the part by the right-hand rule.
    #[schema(min_items = 3, max_items = 3)]
    pub direction: [f64; 3],
    /// σ of the point along two ways across the axis.
    #[schema(min_items = 2, max_items = 2)]
    pub shift_sigma_mm: [f64; 2],
    /// σ of the direction along the same two.
    #[schema(min_items = 2, max_items = 2)]
    pub tilt_sigma_deg: [f64; 2],
    /// σ of the table's angles; missing if nobody knows.
    pub angle_sigma_deg: Option<f64>,
    /// Whether that was stated in the capture, or else estimated from the views.
    pub angle_sigma_stated: bool,
    /// RMS of the boards' deviations from a pure turn over their noise.
    pub noise_ratio: f64,
    /// Per view: angle, degrees; deviation along the turn, radially and along the axis, µm.
    pub deviations_um: Vec<[f64; 4]>,
}

/// The stage as calibrated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageFiguresDto {
    /// Travel per mm of the stage's own count, camera frame.
    #[schema(min_items = 3, max_items = 3)]
    pub direction: [f64; 3],
    /// σ of `direction`.
    #[schema(min_items = 3, max_items = 3)]
    pub sigma: [f64; 3],
    /// Length of `direction` minus 1.
    pub scale_error: f64,
    /// σ of it.
    pub scale_sigma: f64,
    /// RMS deviation across the travel, µm.
    pub straightness_rms_um: f64,
    /// σ per axis of how far the travel may be from straight and even, µm; missing in earlier versions.
    #[serde(default)]
    pub straightness_sigma_um: Option<f64>,
    /// Per view: position, mm; deviation along, and two across, µm.
    pub straightness_um: Vec<[f64; 4]>,
}
