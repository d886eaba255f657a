//! The result of a measurement.

use crate::interface::findings::{Finding, Missing};
use crate::interface::request::Tool;
use crate::interface::shape::Shape;
use crate::interface::verdict::Verdict;

/// Unit of a value and of all quantities compared with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Millimetres.
    Mm,
    /// Degrees.
    Degree,
}

impl Unit {
    /// The symbol.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Mm => "mm",
            Self::Degree => "°",
        }
    }
}

/// Summary of the signed errors of points, mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ErrorSummary {
    /// Number of points.
    pub n_points: usize,
    /// Mean.
    pub mean_mm: f64,
    /// Root of the mean square.
    pub rmse_mm: f64,
    /// Largest magnitude.
    pub max_mm: f64,
}

impl ErrorSummary {
    /// Summary of the errors; all zero if there are none.
    pub fn from_errors(errors_mm: &[f64]) -> Self {
        let n = errors_mm.len();
        if n == 0 {
            return Self::default();
        }
        Self {
            n_points: n,
            mean_mm: errors_mm.iter().sum::<f64>() / n as f64,
            rmse_mm: (errors_mm.iter().map(|e| e * e).sum::<f64>() / n as f64).sqrt(),
            max_mm: errors_mm.iter().fold(0.0, |max, e| max.max(e.abs())),
        }
    }
}

/// A feature as fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedFeature {
    /// Its role in the measurement: `plane`, `base`, `top`, `sphere`, …
    pub role: &'static str,
    /// Geometry, part frame, mm. A plane's point is the centroid of its points, its normal points to the camera.
    pub shape: Shape,
    /// Points used by the fit.
    pub n_points: usize,
    /// Points inside the feature's outline that are off its surface.
    pub n_outliers: usize,
    /// Points on the surface left out because they are near its border or, on curved
    /// features, viewed or lit too steeply.
    pub n_border: usize,
    /// RMS of the residuals along the normal, mm.
    pub rms_mm: f64,
    /// Indices in the cloud of the points used by the fit.
    pub cloud_indices: Vec<u32>,
}

/// One line of the table by orders.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderRow {
    /// Diffraction order.
    pub order: i8,
    /// Errors of this order's points: for a step, height minus nominal (minus the measured value without a nominal);
    /// otherwise the distance to the common fitted feature.
    pub errors: ErrorSummary,
    /// The value fitted to this order's points alone: mean height (step), radius (sphere, cylinder).
    pub value_mm: Option<f64>,
    /// Centre fitted to this order's points alone (sphere), part frame.
    pub centre_mm: Option<[f64; 3]>,
}

/// A measured value with its uncertainty, verdict and fitted features.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// What was measured.
    pub tool: Tool,
    /// The features it was computed from.
    pub features: Vec<FittedFeature>,
    /// The value.
    pub value: f64,
    /// Unit of the value, nominal, error and uncertainties.
    pub unit: Unit,
    /// For an angle: rotation of the second face relative to the first about x and y of the part frame, degrees.
    pub tilts_deg: Option<[f64; 2]>,
    /// The nominal value; 0 for a form.
    pub nominal: Option<f64>,
    /// Value minus nominal.
    pub error: Option<f64>,
    /// Standard uncertainty from the noise of the points.
    pub u_noise: f64,
    /// Standard uncertainty from the contributions common to all points: the calibration's covariance, the temperature,
    /// the lines' thickness; `None` if no calibration was given.
    pub u_systematic: Option<f64>,
    /// U = 2·√(u_noise² + u_systematic²).
    pub expanded_uncertainty: f64,
    /// The tolerance, if given.
    pub tolerance: Option<f64>,
    /// Verdict by ISO 14253-1, if nominal and tolerance were given; undecided if `missing` or `findings` is not empty.
    pub verdict: Option<Verdict>,
    /// Missing uncertainty contributions; empty if U is complete.
    pub missing: Vec<Missing>,
    /// Findings against the model; empty if it fits.
    pub findings: Vec<Finding>,
    /// Errors of all points, as in the rows by order.
    pub errors: ErrorSummary,
    /// The same for each order.
    pub per_order: Vec<OrderRow>,
    /// Remarks for the reader, in sentences.
    pub notes: Vec<String>,
}
