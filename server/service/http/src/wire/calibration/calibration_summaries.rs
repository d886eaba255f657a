//! The summary of a calibration on the wire, as in lists: read from the stored record.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::hardware::dark_frame::DarkFrameUseDto;

/// Summary of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CalibrationSummaryDto {
    /// RMS reprojection error of the board corners.
    pub corner_rms_px: f64,
    /// Standard deviation of a corner per axis, estimated from the residuals.
    pub corner_sigma_px: f64,
    /// Why k3 was estimated or not, in a sentence.
    pub k3_reason: String,
    /// Camera parameters by name: `fx`, `fy`, `cx`, `cy`, `k1`, …
    pub camera: BTreeMap<String, EstimateDto>,
    /// The fits of the board images.
    #[serde(alias = "pictures")]
    pub images: Vec<BoardImageFitDto>,
    /// Model of the light sheets; absent without laser images: such a calibration cannot be used for scanning.
    pub model: Option<LightModelNameDto>,
    /// RMS distance of the laser points from their predicted curves.
    pub light_rms_px: Option<f64>,
    /// Systematic depth uncertainty over the working volume, 1 σ.
    pub systematic_sigma_mm: Option<f64>,
    /// Comparison of the light models; absent with too few poses.
    pub models: Option<ModelComparisonDto>,
    /// Number of board poses.
    pub n_poses: usize,
    /// Poses with a laser image.
    pub n_laser_poses: usize,
    /// Number of stage views.
    pub n_stage_views: usize,
    /// Nearest depth (z of the camera frame) at which the board was seen.
    pub depth_near_mm: f64,
    /// Farthest depth (z of the camera frame) at which the board was seen.
    pub depth_far_mm: f64,
    /// The linear stage; absent if it was not calibrated.
    pub stage: Option<StageSummaryDto>,
    /// The turntable axis; absent without a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<AxisSummaryDto>,
    /// Whether its images were corrected by a dark frame; absent for a calibration from a capture, whose images do not
    /// tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correction: Option<ImageCorrectionDto>,
    /// Warnings, in sentences.
    pub warnings: Vec<String>,
    /// Images that were left out and why, in sentences.
    pub left_out: Vec<String>,
}

/// How the images of a calibration were corrected for what the sensor shows without light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ImageCorrectionDto {
    /// Number of images.
    pub n_images: usize,
    /// Images that were corrected by a dark frame.
    pub n_corrected: usize,
    /// The dark frames; none if no image was corrected, several if it was retaken or the gain changed in between.
    pub dark_frames: Vec<ImageDarkFrameDto>,
}

/// A dark frame that images were corrected with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ImageDarkFrameDto {
    /// What was corrected.
    pub used: DarkFrameUseDto,
    /// When it was taken, ms since 1970 (UTC): identifies it, since a station has one at a time.
    pub taken_at_ms: i64,
    /// Exposure time of the dark frame.
    pub exposure_us: f64,
    /// Its hot pixels, which are replaced.
    pub n_hot_pixels: usize,
}

/// A value with its standard deviation; σ is 0 for a fixed parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EstimateDto {
    /// The value.
    pub value: f64,
    /// σ.
    pub sigma: f64,
}

/// The fit of one board image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoardImageFitDto {
    /// Path of the image in the capture.
    #[serde(alias = "picture")]
    pub image: String,
    /// RMS reprojection error of its corners.
    pub rms_px: f64,
    /// Number of corners.
    pub n_corners: usize,
}

/// Model of the light sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightModelNameDto {
    /// One free plane per order.
    Planes,
    /// A pencil of planes through one line, at the angles of the grating equation.
    Pencil,
    /// The exact curved sheets of the vector grating equation.
    Grating,
}

/// Comparison of the light models on held-out poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ModelComparisonDto {
    /// One entry per model, simplest first.
    pub scores: Vec<ModelScoreDto>,
    /// The recommended model.
    pub recommended: LightModelNameDto,
    /// The reason, in a sentence.
    pub reason: String,
}

/// Error of one light model on held-out poses; figures are absent if it could not be fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ModelScoreDto {
    /// The model.
    pub model: LightModelNameDto,
    /// RMS distance of held-out points from the predicted curves.
    pub held_out_rms_px: Option<f64>,
    /// The same as a depth error along the camera ray.
    pub held_out_rms_mm: Option<f64>,
    /// The systematic part of it: common to all points of a pose and order.
    pub held_out_bias_mm: Option<f64>,
    /// RMS on the poses used in the fit.
    pub fit_rms_px: Option<f64>,
    /// Why it could not be fitted.
    pub failure: Option<String>,
}

/// Summary of a calibrated turntable axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AxisSummaryDto {
    /// A point of the axis, camera frame.
    #[schema(min_items = 3, max_items = 3)]
    pub point_mm: [f64; 3],
    /// Unit vector of the axis; positive angles turn the part by the right-hand rule.
    #[schema(min_items = 3, max_items = 3)]
    pub direction: [f64; 3],
    /// σ of the axis point in two directions perpendicular to the axis.
    #[schema(min_items = 2, max_items = 2)]
    pub shift_sigma_mm: [f64; 2],
    /// σ of the axis direction in the same two directions.
    #[schema(min_items = 2, max_items = 2)]
    pub tilt_sigma_deg: [f64; 2],
    /// σ of the angles of the table; absent if unknown.
    pub angle_sigma_deg: Option<f64>,
    /// Whether it was stated in the capture (true) or estimated from the views (false).
    pub angle_sigma_stated: bool,
    /// RMS deviation of the boards from a pure rotation, divided by their noise.
    pub noise_ratio: f64,
    /// Per view: angle in degrees; tangential, radial and axial deviation in µm.
    pub deviations_um: Vec<[f64; 4]>,
}

/// Summary of a calibrated linear stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageSummaryDto {
    /// Travel per commanded millimetre, camera frame.
    #[schema(min_items = 3, max_items = 3)]
    pub direction: [f64; 3],
    /// σ of `direction`.
    #[schema(min_items = 3, max_items = 3)]
    pub sigma: [f64; 3],
    /// Relative scale error of the stage: length of `direction` minus 1.
    pub scale_error: f64,
    /// σ of the scale error.
    pub scale_sigma: f64,
    /// RMS deviation perpendicular to the travel, µm.
    pub straightness_rms_um: f64,
    /// σ per axis of the deviation from straight and even travel, µm; absent in earlier versions.
    #[serde(default)]
    pub straightness_sigma_um: Option<f64>,
    /// Per view: position in mm; one deviation along and two perpendicular to the travel in µm.
    pub straightness_um: Vec<[f64; 4]>,
    /// σ of the carriage's rotation (pitch, yaw, roll) about its principal axes, largest first, µrad; absent in earlier
    /// versions.
    #[serde(default)]
    pub tilt_sigma_urad: Option<[f64; 3]>,
    /// Per view: position in mm; rotations about the travel and two perpendicular axes in µrad; empty in earlier versions.
    #[serde(default)]
    pub tilt_urad: Vec<[f64; 4]>,
}
