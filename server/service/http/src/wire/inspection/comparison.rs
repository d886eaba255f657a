//! The comparison of a part with a CAD model on the wire.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::inspection::results::PoseDto;
use crate::wire::measurement::measurements::VerdictDto;

/// A scan compared with the surface of a CAD model. Deviations are positive outside the surface; statistics are weighted by
/// area.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ComparisonDto {
    /// The verdict on the covered surface; absent without a tolerance.
    pub verdict: Option<VerdictDto>,
    /// Permitted deviation to either side.
    pub tolerance_mm: Option<f64>,
    /// The frame of the model.
    pub datum_from_part: PoseDto,
    /// Degrees of freedom that the points did not constrain and a best fit left unchanged.
    pub locked: Vec<String>,
    /// RMS of the residuals of a best fit; absent without one.
    pub fit_rms_mm: Option<f64>,
    /// Number of points that were compared.
    pub n_points: usize,
    /// Number of points too far from the surface to be compared.
    pub n_beyond: usize,
    /// Mean deviation.
    pub mean_mm: f64,
    /// Root of the mean square.
    pub rms_mm: f64,
    /// Standard deviation.
    pub std_mm: f64,
    /// Smallest and largest deviation of single points.
    #[schema(min_items = 2, max_items = 2)]
    pub range_mm: [f64; 2],
    /// Percentiles.
    pub percentiles: DeviationPercentilesDto,
    /// Area of the compared surface.
    pub area_mm2: f64,
    /// Area covered by points.
    pub covered_mm2: f64,
    /// Area out of tolerance; absent without a tolerance.
    pub out_of_tolerance_mm2: Option<f64>,
    /// Area out of tolerance by more than U.
    pub surely_out_of_tolerance_mm2: Option<f64>,
    /// The largest deviations, largest first.
    pub worst: Vec<WorstDeviationDto>,
    /// Whether U contains all contributions.
    pub uncertainty_complete: bool,
    /// Names of the contributions missing from U.
    pub uncertainty_missing: Vec<String>,
    /// Notes, in sentences.
    pub notes: Vec<String>,
}

/// Percentiles of deviations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DeviationPercentilesDto {
    /// 2.5 %.
    pub p2_5_mm: f64,
    /// 50 %.
    pub p50_mm: f64,
    /// 97.5 %.
    pub p97_5_mm: f64,
}

/// A large deviation: the mean of a cell of the surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WorstDeviationDto {
    /// Its place on the surface, in the frame of the model.
    #[schema(min_items = 3, max_items = 3)]
    pub at_mm: [f64; 3],
    /// The deviation.
    pub deviation_mm: f64,
    /// Its expanded uncertainty (k = 2).
    pub expanded_uncertainty_mm: f64,
    /// Number of its points.
    pub n_points: usize,
}
