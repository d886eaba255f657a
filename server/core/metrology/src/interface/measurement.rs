//! The result of a measurement.

use crate::interface::doubts::{Finding, Missing};
use crate::interface::request::Tool;
use crate::interface::shape::Shape;
use crate::interface::verdict::Verdict;

/// Unit of a value and all that is compared with it.
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

/// Signed errors of points, summed up, mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ErrorSummary {
    /// How many.
    pub n_points: usize,
    /// Mean.
    pub mean_mm: f64,
    /// Root of the mean square.
    pub rmse_mm: f64,
    /// Largest magnitude.
    pub max_mm: f64,
}

impl ErrorSummary {
    /// Sums up; all zero for no errors.
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
    /// Its part in the measurement: `plane`, `base`, `top`, `sphere`, …
    pub role: &'static str,
    /// Geometry, part frame, mm. A plane's point is the centroid of its points, its normal looks to the camera.
    pub shape: Shape,
    /// Points the fit rests on.
    pub n_points: usize,
    /// Points inside the feature's outline that are off its surface.
    pub n_outliers: usize,
    /// Points on the surface left out because they are near its border or, on curved
    /// features, seen or lit too steeply.
    pub n_border: usize,
    /// RMS of the residuals along the normal, mm.
    pub rms_mm: f64,
    /// The points the fit rests on, by their place in the cloud.
    pub cloud_indices: Vec<u32>,
}

/// One line of the table by orders.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderRow {
    /// Diffraction order.
    pub order: i8,
    /// Errors of this order's points: for a step, height minus nominal (minus the measured value without a nominal);
    /// for all else the distance to the common fitted feature.
    pub errors: ErrorSummary,
    /// The value fitted to this order's points alone: mean height (step), radius (sphere, cylinder).
    pub value_mm: Option<f64>,
    /// Centre fitted to this order's points alone (sphere), part frame.
    pub centre_mm: Option<[f64; 3]>,
}

/// A measured value with all that is needed to judge it.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// What was measured.
    pub tool: Tool,
    /// The features it rests on.
    pub features: Vec<FittedFeature>,
    /// The value.
    pub value: f64,
    /// Unit of the value, nominal, error and uncertainties.
    pub unit: Unit,
    /// Of an angle: how far the second face is turned from the first about x and y of the part frame, degrees.
    pub tilts_deg: Option<[f64; 2]>,
    /// The value it should have; 0 for a form.
    pub nominal: Option<f64>,
    /// Value minus nominal.
    pub error: Option<f64>,
    /// Standard uncertainty from the noise of the points.
    pub u_noise: f64,
    /// Standard uncertainty from all that the points share: the calibration's covariance, the temperature, the lines'
    /// thickness; absent if no calibration was given.
    pub u_systematic: Option<f64>,
    /// U = 2·√(u_noise² + u_systematic²).
    pub expanded_uncertainty: f64,
    /// The tolerance asked for.
    pub tolerance: Option<f64>,
    /// Verdict by ISO 14253-1, if nominal and tolerance were given; undecided if anything is missing or found.
    pub verdict: Option<Verdict>,
    /// What the uncertainty should hold and does not; it is complete if there is nothing.
    pub missing: Vec<Missing>,
    /// What speaks against the model; it fits if there is nothing.
    pub findings: Vec<Finding>,
    /// Errors of all points, as in the rows by order.
    pub errors: ErrorSummary,
    /// The same for each order.
    pub per_order: Vec<OrderRow>,
    /// What a reader must know, in sentences.
    pub notes: Vec<String>,
}
