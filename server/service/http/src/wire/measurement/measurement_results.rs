//! What a measurement gave, on the wire: read from the record, which keeps the figures as `sheaf measure --json`
//! prints them.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::measurement::measurements::{ToolDto, VerdictDto};

/// What was asked of a measurement, with what was filled in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeasurementRequestDto {
    /// What was measured.
    pub tool: ToolDto,
    /// Which one, where a tool is used more than once.
    #[serde(default)]
    pub name: Option<String>,
    /// What it should be, mm (degrees for an angle).
    pub nominal_mm: Option<f64>,
    /// Symmetric limits around the nominal, mm (degrees for an angle).
    pub tolerance_mm: Option<f64>,
    /// Seed of the search.
    pub seed: u64,
    /// Only points inside this box of the part frame were looked at; missing: all.
    pub region_mm: Option<BoxDto>,
}

/// A box of the part frame, mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoxDto {
    /// Lowest x, y, z.
    #[schema(min_items = 3, max_items = 3)]
    pub min: [f64; 3],
    /// Highest x, y, z.
    #[schema(min_items = 3, max_items = 3)]
    pub max: [f64; 3],
}

/// What a measurement gave. Lengths are in `unit`, but for those that name theirs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeasurementResultDto {
    /// What was measured.
    pub tool: ToolDto,
    /// Which one, where a tool is used more than once.
    #[serde(default)]
    pub name: Option<String>,
    /// `mm` or `°`.
    pub unit: String,
    /// The value; missing if it could not be measured: the notes say why.
    pub value: Option<f64>,
    /// The value it should have.
    pub nominal: Option<f64>,
    /// Value minus nominal.
    pub error: Option<f64>,
    /// Standard uncertainty from the noise of the points.
    pub u_noise: Option<f64>,
    /// Standard uncertainty from all that the points share: calibration, temperature, thickness of the lines.
    pub u_systematic: Option<f64>,
    /// U, `coverage_factor` times the standard uncertainty.
    pub expanded_uncertainty: Option<f64>,
    /// k.
    pub coverage_factor: f64,
    /// Whether U holds all it should; missing if nothing was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty_complete: Option<bool>,
    /// What U lacks, by name.
    #[serde(default)]
    pub uncertainty_missing: Vec<String>,
    /// What speaks against the fitted model.
    #[serde(default)]
    pub findings: Vec<FindingDto>,
    /// Of an angle: how far the second face is turned from the first about x and y of the part frame, degrees.
    #[serde(default)]
    #[schema(min_items = 2, max_items = 2)]
    pub tilts_deg: Option<[f64; 2]>,
    /// Symmetric limits around the nominal.
    pub tolerance: Option<f64>,
    /// How it was judged; missing without a tolerance.
    pub verdict: Option<VerdictDto>,
    /// Distances of all points from the fitted features; missing if nothing was measured.
    pub errors: Option<ErrorsDto>,
    /// The same for each order.
    pub per_order: Vec<OrderErrorsDto>,
    /// The features it rests on.
    pub features: Vec<FeatureDto>,
    /// What a reader must know, in sentences.
    pub notes: Vec<String>,
    /// The calibration of the cloud.
    pub calibration_id: String,
    /// `complete`, `partial` or `invalid`: what the scan was worth when it was measured.
    pub scan_state: String,
}

/// What speaks against the fitted model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FindingDto {
    /// Its name: `model_misfit`, `off_surface`, `short_arc`.
    pub kind: String,
    /// The same in a sentence.
    pub text: String,
}

/// Signed distances of points from their feature, summed up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ErrorsDto {
    /// How many.
    pub n_points: usize,
    /// Mean.
    pub mean_mm: f64,
    /// Root of the mean square.
    pub rmse_mm: f64,
    /// Largest magnitude.
    pub max_mm: f64,
}

/// The points of one order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OrderErrorsDto {
    /// The order.
    pub order: i8,
    /// Distances of its points from the features.
    pub errors: ErrorsDto,
    /// The value by its points alone, if they determine it.
    pub value_mm: Option<f64>,
    /// Centre of a sphere by its points alone, part frame.
    #[schema(min_items = 3, max_items = 3)]
    pub centre_mm: Option<[f64; 3]>,
}

/// A fitted feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FeatureDto {
    /// What it is to the measurement: `plane`, `top`, `base`, …
    pub role: String,
    /// Its shape.
    pub shape: ShapeDto,
    /// Points it was fitted to.
    pub n_points: usize,
    /// Points left out because they are off the surface.
    pub n_outliers: usize,
    /// Points left out because they are near its border.
    pub n_border: usize,
    /// Root mean square of the points' distances from it.
    pub rms_mm: f64,
    /// Where its points are; missing without points.
    #[serde(default)]
    pub region: Option<SurfaceRegionDto>,
}

/// A shape in the part frame, mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ShapeDto {
    /// A plane.
    Plane {
        /// A point of it.
        #[schema(min_items = 3, max_items = 3)]
        point_mm: [f64; 3],
        /// Its normal, of length 1.
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
        /// A point of its axis.
        #[schema(min_items = 3, max_items = 3)]
        point_mm: [f64; 3],
        /// Direction of its axis, of length 1.
        #[schema(min_items = 3, max_items = 3)]
        axis: [f64; 3],
        /// Its radius.
        radius_mm: f64,
    },
}

/// Cells of space that hold the points of a feature, part frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SurfaceRegionDto {
    /// Lowest corner of the first cell.
    #[schema(min_items = 3, max_items = 3)]
    pub origin_mm: [f64; 3],
    /// Edge of a cell.
    pub cell_mm: f64,
    /// Cells along x, y, z.
    #[schema(min_items = 3, max_items = 3)]
    pub size: [usize; 3],
    /// Numbers of the cells with points: x + size_x · (y + size_y · z).
    pub cells: Vec<usize>,
    /// Largest distance from the shape of a point that belongs.
    pub band_mm: f64,
}
