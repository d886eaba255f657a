//! The document `sheaf-calibration/1` on the wire, as in the file: `server/docs/schemas/calibration.schema.json`.
//! Millimetres, pixels, radians; vectors in the camera frame.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::calibration::calibration_summaries::{LightModelNameDto, ModelScoreDto};

/// The document `sheaf-calibration/1`, as `sheaf calibrate` writes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CalibrationDocumentDto {
    /// `sheaf-calibration/1`.
    pub format: String,
    /// First digits of the SHA-256 of the document, computed with an empty id.
    pub id: String,
    /// The camera.
    pub camera: CameraModelDto,
    /// Diffraction orders from the top (left) of the image downwards (rightwards).
    pub orders: Vec<i8>,
    /// The light sheets.
    pub light: LightSheetsDto,
    /// The stage; absent if it was not calibrated.
    pub stage: Option<CalibratedStageDto>,
    /// Range of z in which the board was seen.
    pub depth_range: DepthRangeDto,
    /// Joint covariance of camera, light and stage.
    pub covariance: CovarianceDto,
    /// The program that computed it.
    pub software: SoftwareDto,
    /// The files it was computed from, with their hashes.
    pub inputs: Vec<InputFileDto>,
    /// Constants of the computation that affect the result, by name.
    pub parameters: BTreeMap<String, f64>,
    /// Quality figures of the calibration.
    pub report: CalibrationReportDto,
}

/// Pinhole camera with Brown–Conrady distortion, OpenCV convention.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraModelDto {
    /// Image width.
    pub width_px: usize,
    /// Image height.
    pub height_px: usize,
    /// Focal length along u.
    pub fx_px: f64,
    /// Focal length along v.
    pub fy_px: f64,
    /// Principal point, u.
    pub cx_px: f64,
    /// Principal point, v.
    pub cy_px: f64,
    /// Radial distortion, second power.
    pub k1: f64,
    /// Radial distortion, fourth power.
    pub k2: f64,
    /// Tangential distortion.
    pub p1: f64,
    /// Tangential distortion.
    pub p2: f64,
    /// Radial distortion, sixth power.
    pub k3: f64,
}

/// The light sheets, in one of the three models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "model", rename_all = "snake_case")]
pub enum LightSheetsDto {
    /// One free plane per order.
    Planes {
        /// The planes.
        planes: Vec<LightPlaneDto>,
    },
    /// A pencil of planes through one line, at the angles of the grating equation.
    Pencil {
        /// A point of the line.
        #[schema(min_items = 3, max_items = 3)]
        point_mm: [f64; 3],
        /// Direction of the line.
        #[schema(min_items = 3, max_items = 3)]
        direction: [f64; 3],
        /// Normal of the plane of order 0.
        #[schema(min_items = 3, max_items = 3)]
        base_normal: [f64; 3],
        /// Wavelength over the grating's period.
        wavelength_over_period: f64,
    },
    /// The exact curved sheets of the vector grating equation.
    Grating {
        /// Point source of the fan.
        #[schema(min_items = 3, max_items = 3)]
        source_mm: [f64; 3],
        /// Direction of the laser beam.
        #[schema(min_items = 3, max_items = 3)]
        axis: [f64; 3],
        /// Direction in which the beam is fanned out.
        #[schema(min_items = 3, max_items = 3)]
        fan: [f64; 3],
        /// Normal of the grating.
        #[schema(min_items = 3, max_items = 3)]
        normal: [f64; 3],
        /// Direction of the grooves.
        #[schema(min_items = 3, max_items = 3)]
        groove: [f64; 3],
        /// Distance from the source to the grating.
        gap_mm: f64,
        /// Wavelength over the grating's period.
        wavelength_over_period: f64,
    },
}

/// A plane: normal · X + offset = 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LightPlaneDto {
    /// Its order.
    pub order: i8,
    /// Its normal.
    #[schema(min_items = 3, max_items = 3)]
    pub normal: [f64; 3],
    /// Its offset.
    pub offset_mm: f64,
}

/// The calibrated stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(untagged)]
pub enum CalibratedStageDto {
    /// A linear stage.
    Linear(StageAxisDto),
    /// A rotary stage.
    Rotary(RotaryAxisDto),
}

/// The axis of a turntable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RotaryAxisDto {
    /// Always `rotary`.
    pub kind: RotaryKindDto,
    /// A point of the axis, camera frame.
    #[schema(min_items = 3, max_items = 3)]
    pub point_mm: [f64; 3],
    /// Unit vector of the axis; positive angles turn the part by the right-hand rule.
    #[schema(min_items = 3, max_items = 3)]
    pub direction: [f64; 3],
    /// Standard deviation of the angles of the table; absent if unknown (unknown does not mean zero).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_sigma_deg: Option<f64>,
}

/// The kind that distinguishes a rotary from a linear stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RotaryKindDto {
    /// A rotary stage.
    Rotary,
}

/// The travel of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageAxisDto {
    /// Travel per commanded millimetre.
    #[schema(min_items = 3, max_items = 3)]
    pub direction_mm_per_mm: [f64; 3],
    /// Straightness and evenness of the travel; absent if unknown (unknown does not mean zero).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub straightness: Option<StraightnessDto>,
    /// Pitch, yaw and roll of the travel; absent if unknown (unknown does not mean zero).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tilt: Option<TiltDto>,
}

/// Deviations from straight and even travel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StraightnessDto {
    /// Standard deviation, the same along every axis.
    pub sigma_mm: f64,
    /// Stage position of the first node.
    pub first_mm: f64,
    /// Stage position of the last node.
    pub last_mm: f64,
    /// Evenly spaced positions whose deviations are independent.
    pub n_nodes: usize,
}

/// Rotations of the carriage: pitch, yaw and roll.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TiltDto {
    /// Three independent rotation vectors of one standard deviation, camera frame.
    #[schema(min_items = 3, max_items = 3)]
    pub sigmas_rad: [[f64; 3]; 3],
    /// Centre of the rotations at the middle of the nodes, camera frame.
    #[schema(min_items = 3, max_items = 3)]
    pub centre_mm: [f64; 3],
    /// Stage position of the first node.
    pub first_mm: f64,
    /// Stage position of the last node.
    pub last_mm: f64,
    /// Evenly spaced positions whose rotations are independent.
    pub n_nodes: usize,
}

/// Range of depth, z of the camera frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DepthRangeDto {
    /// Nearest.
    pub near_mm: f64,
    /// Farthest.
    pub far_mm: f64,
}

/// Covariance of the parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CovarianceDto {
    /// Names of rows and columns: camera, light (local increments), stage.
    pub parameters: Vec<String>,
    /// The matrix, row by row.
    pub matrix: Vec<Vec<f64>>,
}

/// A program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SoftwareDto {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
}

/// An input file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct InputFileDto {
    /// Its path in the capture.
    pub path: String,
    /// SHA-256 of its content.
    pub sha256: String,
}

/// Quality figures of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CalibrationReportDto {
    /// The fit of the camera.
    pub camera: CameraFitDto,
    /// The fit of the light sheets; absent without laser images.
    pub light: Option<LightFitDto>,
    /// Comparison of the light models; absent with too few poses.
    pub cross_validation: Option<CrossValidationDto>,
    /// The fit of a linear stage; absent without stage views.
    pub stage: Option<StageFitDto>,
    /// The fit of a turntable axis; absent without stage views.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<AxisFitDto>,
    /// Warnings, in sentences.
    pub warnings: Vec<String>,
}

/// The fit of the camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraFitDto {
    /// RMS reprojection error of the corners.
    pub rms_px: f64,
    /// Standard deviation of a corner per axis, estimated from the residuals.
    pub corner_sigma_px: f64,
    /// Termination reason of the solver: `gradient`, `step` or `cost`; absent in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub termination: Option<String>,
    /// Why k3 was estimated or not, in a sentence.
    pub k3: String,
    /// σ of fx, fy, cx, cy, k1, k2, p1, p2, k3.
    #[schema(min_items = 9, max_items = 9)]
    pub sigma: [f64; 9],
    /// The board images.
    pub views: Vec<ViewFitDto>,
}

/// The fit of one board image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ViewFitDto {
    /// The image.
    pub name: String,
    /// RMS reprojection error of its corners.
    pub rms_px: f64,
    /// Number of corners.
    pub n_corners: usize,
}

/// The fit of the light sheets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LightFitDto {
    /// The model.
    pub model: LightModelNameDto,
    /// RMS distance of the laser points from their predicted curves.
    pub rms_px: f64,
    /// Systematic depth uncertainty over the working volume, 1 σ.
    pub systematic_sigma_mm: f64,
    /// Termination reason of the solver: `gradient`, `step` or `cost`; absent in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub termination: Option<String>,
    /// Estimate, σ and nominal value; absent for free planes.
    #[schema(min_items = 3, max_items = 3)]
    pub wavelength_over_period: Option<[f64; 3]>,
    /// Residuals per order and board.
    pub lines: Vec<LineFitDto>,
    /// Points rejected because they are off the board.
    pub rejected_off_board: usize,
    /// Points rejected because they are at the edge of a square.
    pub rejected_square_edge: usize,
    /// Points rejected because their order is ambiguous.
    pub rejected_unlabelled: usize,
    /// Points rejected as outliers.
    pub rejected_outlier: usize,
}

/// The fit of one order on one board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LineFitDto {
    /// The pose of the board.
    pub pose: String,
    /// The order.
    pub order: i8,
    /// Points used.
    pub n_points: usize,
    /// Mean signed distance.
    pub mean_px: f64,
    /// RMS distance.
    pub rms_px: f64,
    /// RMS of distance over predicted σ.
    pub normalised_rms: f64,
    /// Outliers.
    pub n_outliers: usize,
}

/// Comparison of the light models on held-out poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CrossValidationDto {
    /// One entry per model, simplest first.
    pub models: Vec<ModelScoreDto>,
    /// The recommended model.
    pub recommended: LightModelNameDto,
    /// The reason, in a sentence.
    pub reason: String,
}

/// The fit of a turntable's axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AxisFitDto {
    /// σ of the axis direction in two perpendicular directions.
    #[schema(min_items = 2, max_items = 2)]
    pub tilt_sigma_deg: [f64; 2],
    /// σ of the axis point in the same two directions.
    #[schema(min_items = 2, max_items = 2)]
    pub shift_sigma_mm: [f64; 2],
    /// σ of the angles of the table; absent if unknown.
    pub angle_sigma_deg: Option<f64>,
    /// Whether it was stated in the capture (true) or estimated from the views (false).
    pub angle_sigma_stated: bool,
    /// RMS deviation of the boards from a pure rotation, divided by their noise.
    pub noise_ratio: f64,
    /// Per view: angle in degrees; tangential, radial and axial deviation in µm.
    pub deviations: Vec<[f64; 4]>,
}

/// The fit of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageFitDto {
    /// σ of the direction's components.
    #[schema(min_items = 3, max_items = 3)]
    pub sigma: [f64; 3],
    /// Relative scale error of the stage: length of the direction minus 1.
    pub scale_error: f64,
    /// σ of the scale error.
    pub scale_sigma: f64,
    /// RMS deviation perpendicular to the travel, µm.
    pub straightness_rms_um: f64,
    /// Per view: position in mm; one deviation along and two perpendicular to the travel in µm.
    pub straightness: Vec<[f64; 4]>,
}
