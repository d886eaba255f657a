//! The result of a measurement on the wire: read from the stored record, which has the form that `sheaf measure --json`
//! prints.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::measurement::measurements::{ToolDto, VerdictDto};
use crate::wire::scan::scans::ScanStateDto;

/// The requested measurement, with defaults filled in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeasurementRequestDto {
    /// The tool.
    pub tool: ToolDto,
    /// Name of the characteristic, if the same tool is used more than once.
    #[serde(default)]
    pub name: Option<String>,
    /// Nominal value, mm (degrees for an angle).
    pub nominal_mm: Option<f64>,
    /// Symmetric tolerance around the nominal, mm (degrees for an angle).
    pub tolerance_mm: Option<f64>,
    /// Random seed of the search.
    pub seed: u64,
    /// Only points in this box of the part frame were used; absent: all.
    pub region_mm: Option<BoxDto>,
}

/// An axis-aligned box in the part frame, mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoxDto {
    /// Minimum x, y, z.
    #[schema(min_items = 3, max_items = 3)]
    pub min: [f64; 3],
    /// Maximum x, y, z.
    #[schema(min_items = 3, max_items = 3)]
    pub max: [f64; 3],
}

/// Result of a measurement. Values are in `unit` unless the field name states another unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeasurementResultDto {
    /// The tool.
    pub tool: ToolDto,
    /// Name of the characteristic, if the same tool is used more than once.
    #[serde(default)]
    pub name: Option<String>,
    /// `mm` or `°`.
    pub unit: String,
    /// The value; absent if it could not be measured (see `notes`).
    pub value: Option<f64>,
    /// Nominal value.
    pub nominal: Option<f64>,
    /// Value minus nominal.
    pub error: Option<f64>,
    /// Standard uncertainty due to the noise of the points.
    pub u_noise: Option<f64>,
    /// Standard uncertainty due to effects common to the points: calibration, temperature, line thickness.
    pub u_systematic: Option<f64>,
    /// Expanded uncertainty U: `coverage_factor` times the standard uncertainty.
    pub expanded_uncertainty: Option<f64>,
    /// Coverage factor k.
    pub coverage_factor: f64,
    /// Whether U contains all contributions; absent if nothing was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty_complete: Option<bool>,
    /// Names of the contributions missing from U.
    #[serde(default)]
    pub uncertainty_missing: Vec<String>,
    /// Findings that question the fitted model.
    #[serde(default)]
    pub findings: Vec<FindingDto>,
    /// For angles: rotation of the second face relative to the first about x and y of the part frame, degrees.
    #[serde(default)]
    #[schema(min_items = 2, max_items = 2)]
    pub tilts_deg: Option<[f64; 2]>,
    /// Symmetric tolerance around the nominal.
    pub tolerance: Option<f64>,
    /// The verdict; absent without a tolerance.
    pub verdict: Option<VerdictDto>,
    /// Distances of all points from the fitted features; absent if nothing was measured.
    pub errors: Option<ErrorsDto>,
    /// The same per order.
    pub per_order: Vec<OrderErrorsDto>,
    /// The fitted features.
    pub features: Vec<FeatureDto>,
    /// Notes, in sentences.
    pub notes: Vec<String>,
    /// The calibration of the cloud.
    pub calibration_id: String,
    /// State of the scan when it was measured.
    pub scan_state: ScanStateDto,
}

/// What a finding questions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FindingKindDto {
    /// Noise and form do not explain the residuals.
    ModelMisfit,
    /// Points inside the outline of the feature are off its surface.
    OffSurface,
    /// The points cover too short an arc to determine the radius.
    ShortArc,
}

/// A finding that questions the fitted model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FindingDto {
    /// What it questions.
    pub kind: FindingKindDto,
    /// Its text.
    pub text: String,
}

/// Statistics of the signed distances of points from their feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ErrorsDto {
    /// Number of points.
    pub n_points: usize,
    /// Mean.
    pub mean_mm: f64,
    /// Root mean square.
    pub rmse_mm: f64,
    /// Largest magnitude.
    pub max_mm: f64,
}

/// Results for the points of one order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OrderErrorsDto {
    /// The order.
    pub order: i8,
    /// Distances of its points from the features.
    pub errors: ErrorsDto,
    /// The value computed from its points alone, if they determine it.
    pub value_mm: Option<f64>,
    /// Sphere centre computed from its points alone, part frame.
    #[schema(min_items = 3, max_items = 3)]
    pub centre_mm: Option<[f64; 3]>,
}

/// A fitted feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FeatureDto {
    /// Its role in the measurement: `plane`, `top`, `base`, …
    pub role: String,
    /// Its shape.
    pub shape: ShapeDto,
    /// Number of points used in the fit.
    pub n_points: usize,
    /// Points rejected as outliers.
    pub n_outliers: usize,
    /// Points rejected because they are near the border.
    pub n_border: usize,
    /// RMS distance of the points from the feature.
    pub rms_mm: f64,
    /// The region of its points; absent without points.
    #[serde(default)]
    pub region: Option<SurfaceRegionDto>,
}

/// A shape in the part frame, mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ShapeDto {
    /// A plane.
    Plane {
        /// A point on the plane.
        #[schema(min_items = 3, max_items = 3)]
        point_mm: [f64; 3],
        /// Unit normal.
        #[schema(min_items = 3, max_items = 3)]
        normal: [f64; 3],
    },
    /// A sphere.
    Sphere {
        /// Its centre.
        #[schema(min_items = 3, max_items = 3)]
        centre_mm: [f64; 3],
        /// Its radius.
        radius_mm: f64,
    },
    /// A cylinder.
    Cylinder {
        /// A point on the axis.
        #[schema(min_items = 3, max_items = 3)]
        point_mm: [f64; 3],
        /// Unit direction of the axis.
        #[schema(min_items = 3, max_items = 3)]
        axis: [f64; 3],
        /// Its radius.
        radius_mm: f64,
    },
}

/// Voxels that contain the points of a feature, part frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SurfaceRegionDto {
    /// Minimum corner of the first voxel.
    #[schema(min_items = 3, max_items = 3)]
    pub origin_mm: [f64; 3],
    /// Voxel size.
    pub cell_mm: f64,
    /// Number of voxels along x, y, z.
    #[schema(min_items = 3, max_items = 3)]
    pub size: [usize; 3],
    /// Indices of the voxels with points: x + size_x · (y + size_y · z).
    pub cells: Vec<usize>,
    /// Maximum distance of a point from the shape.
    pub band_mm: f64,
}
