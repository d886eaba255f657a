//! The document `sheaf-calibration/1` on the wire: as the file holds it, `server/docs/schemas/calibration.schema.json`.
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
    /// First digits of the document's SHA-256, computed with an empty id.
    pub id: String,
    /// The camera.
    pub camera: CameraModelDto,
    /// Diffraction orders from the top (left) of the image downwards (rightwards).
    pub orders: Vec<i8>,
    /// The light sheets.
    pub light: LightSheetsDto,
    /// The stage; missing if it was not calibrated.
    pub stage: Option<CalibratedStageDto>,
    /// z between which the board was seen.
    pub depth_range: DepthRangeDto,
    /// Joint covariance of camera, light and stage.
    pub covariance: CovarianceDto,
    /// What computed it.
    pub software: SoftwareDto,
    /// The files it was computed from, by content.
    pub inputs: Vec<InputFileDto>,
    /// Constants of the computation that shape the result, by name.
    pub parameters: BTreeMap<String, f64>,
    /// What the calibration says about itself.
    pub report: CalibrationReportDto,
}

/// A pinhole with Brown–Conrady distortion in OpenCV's convention.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraModelDto {
    /// Columns of the pictures.
    pub width_px: usize,
    /// Rows of the pictures.
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

/// The light sheets by one of the three models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "model", rename_all = "snake_case")]
pub enum LightSheetsDto {
    /// One free plane per order.
    Planes {
        /// The planes.
        planes: Vec<LightPlaneDto>,
    },
    /// Planes through one line at the angles of the grating equation.
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
        /// From where the light spreads.
        #[schema(min_items = 3, max_items = 3)]
        source_mm: [f64; 3],
        /// Where the laser points.
        #[schema(min_items = 3, max_items = 3)]
        axis: [f64; 3],
        /// Along which it spreads.
        #[schema(min_items = 3, max_items = 3)]
        fan: [f64; 3],
        /// Normal of the grating.
        #[schema(min_items = 3, max_items = 3)]
        normal: [f64; 3],
        /// Direction of its grooves.
        #[schema(min_items = 3, max_items = 3)]
        groove: [f64; 3],
        /// From the source to the grating.
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

/// The stage as calibrated: what moves the part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(untagged)]
pub enum CalibratedStageDto {
    /// It travels.
    Linear(StageAxisDto),
    /// It turns.
    Rotary(RotaryAxisDto),
}

/// The axis of a turntable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RotaryAxisDto {
    /// Always `rotary`.
    pub kind: RotaryWordDto,
    /// A point of the axis, camera frame.
    #[schema(min_items = 3, max_items = 3)]
    pub point_mm: [f64; 3],
    /// Unit vector about which growing angles turn the part by the right-hand rule.
    #[schema(min_items = 3, max_items = 3)]
    pub direction: [f64; 3],
    /// One standard deviation of the table's angles; missing where that is unknown, which is not zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_sigma_deg: Option<f64>,
}

/// The word that distinguishes a turntable from a linear stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RotaryWordDto {
    /// It turns.
    Rotary,
}

/// The travel of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageAxisDto {
    /// Millimetres per millimetre of the stage's own count.
    #[schema(min_items = 3, max_items = 3)]
    pub direction_mm_per_mm: [f64; 3],
    /// How far the travel may be from straight and even; missing where that is unknown, which is not zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub straightness: Option<StraightnessDto>,
}

/// Deviations from straight and even travel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StraightnessDto {
    /// One standard deviation, alike along every axis.
    pub sigma_mm: f64,
    /// Stage position of the first node.
    pub first_mm: f64,
    /// Stage position of the last node.
    pub last_mm: f64,
    /// Evenly spaced positions whose deviations are independent.
    pub n_nodes: usize,
}

/// Depths, z of the camera frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DepthRangeDto {
    /// The nearest.
    pub near_mm: f64,
    /// The farthest.
    pub far_mm: f64,
}

/// Covariance of the parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CovarianceDto {
    /// Names of rows and columns: camera, light (local steps), stage.
    pub parameters: Vec<String>,
    /// Its rows.
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

/// A file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct InputFileDto {
    /// Its path in the capture.
    pub path: String,
    /// SHA-256 of its content.
    pub sha256: String,
}

/// What a calibration says about itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CalibrationReportDto {
    /// The fit of the camera.
    pub camera: CameraFitDto,
    /// The fit of the light sheets; missing without laser pictures.
    pub light: Option<LightFitDto>,
    /// The light models compared; missing with too few poses.
    pub cross_validation: Option<CrossValidationDto>,
    /// The fit of the stage; missing without pictures on it.
    pub stage: Option<StageFitDto>,
    /// The fit of a turntable's axis; missing without pictures on one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<AxisFitDto>,
    /// What to know about it, in sentences.
    pub warnings: Vec<String>,
}

/// The fit of the camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraFitDto {
    /// RMS distance of the corners from where the camera expects them.
    pub rms_px: f64,
    /// Standard deviation of a corner per axis, as estimated from the residuals.
    pub corner_sigma_px: f64,
    /// Why the fit stopped: `gradient`, `step` or `cost`; missing in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub termination: Option<String>,
    /// Why the sixth-power distortion was estimated or not, in a sentence.
    pub k3: String,
    /// σ of fx, fy, cx, cy, k1, k2, p1, p2, k3.
    #[schema(min_items = 9, max_items = 9)]
    pub sigma: [f64; 9],
    /// The board pictures.
    pub views: Vec<ViewFitDto>,
}

/// How a board picture fits the camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ViewFitDto {
    /// The picture.
    pub name: String,
    /// RMS distance of its corners from where the camera expects them.
    pub rms_px: f64,
    /// Its corners.
    pub n_corners: usize,
}

/// The fit of the light sheets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LightFitDto {
    /// The model.
    pub model: LightModelNameDto,
    /// RMS distance of the points from their predicted curves.
    pub rms_px: f64,
    /// What it leaves of depth uncertainty over the working volume.
    pub systematic_sigma_mm: f64,
    /// Why the fit stopped: `gradient`, `step` or `cost`; missing in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub termination: Option<String>,
    /// Estimate, σ, data sheet; missing for free planes.
    #[schema(min_items = 3, max_items = 3)]
    pub wavelength_over_period: Option<[f64; 3]>,
    /// Residuals of each order on each board.
    pub lines: Vec<LineFitDto>,
    /// Points off the board.
    pub rejected_off_board: usize,
    /// Points at the edges of squares.
    pub rejected_square_edge: usize,
    /// Points without a certain order.
    pub rejected_unlabelled: usize,
    /// Points too far from their curve.
    pub rejected_outlier: usize,
}

/// How an order on a board fits its light sheet.
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
    /// Points left out.
    pub n_outliers: usize,
}

/// The light models, compared on poses that were left out of their fits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CrossValidationDto {
    /// One per model, simplest first.
    pub models: Vec<ModelScoreDto>,
    /// The one with evidence on its side.
    pub recommended: LightModelNameDto,
    /// Why, in a sentence.
    pub reason: String,
}

/// The fit of a turntable's axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AxisFitDto {
    /// σ of the direction along two ways across it.
    #[schema(min_items = 2, max_items = 2)]
    pub tilt_sigma_deg: [f64; 2],
    /// σ of the point along the same two.
    #[schema(min_items = 2, max_items = 2)]
    pub shift_sigma_mm: [f64; 2],
    /// σ of the table's angles; missing if nobody knows.
    pub angle_sigma_deg: Option<f64>,
    /// Whether that was stated in the capture, or else estimated from the views.
    pub angle_sigma_stated: bool,
    /// RMS of the boards' deviations from a pure turn over their noise.
    pub noise_ratio: f64,
    /// Per view: angle, degrees; deviation along the turn, radially and along the axis, µm.
    pub deviations: Vec<[f64; 4]>,
}

/// The fit of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageFitDto {
    /// σ of the direction's components.
    #[schema(min_items = 3, max_items = 3)]
    pub sigma: [f64; 3],
    /// Length of the direction minus 1.
    pub scale_error: f64,
    /// σ of it.
    pub scale_sigma: f64,
    /// RMS deviation across the travel, µm.
    pub straightness_rms_um: f64,
    /// Per view: position, mm; deviation along, and two across, µm.
    pub straightness: Vec<[f64; 4]>,
}
