//! The result of a plan evaluated on a cloud.

use std::collections::BTreeMap;

use optics::{PartFrame, Rigid};

use crate::cad::comparison::Comparison;
use crate::evaluation::alignment::DatumFrame;
use crate::evaluation::geometry::Geometry;
use crate::interface::findings::{Finding, Missing};
use crate::interface::measurement::Unit;
use crate::interface::part_verdict::PartVerdict;
use crate::interface::request::MeasureError;
use crate::interface::verdict::Limits;

/// The result of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanResult {
    /// The features, in the order of the plan.
    pub features: Vec<FeatureResult>,
    /// The datum frame, if the plan has an alignment and the features for it were found.
    pub datum_from_part: Option<Rigid<DatumFrame, PartFrame>>,
    /// Why there is no datum frame.
    pub alignment_failure: Option<MeasureError>,
    /// The characteristics, in the order of the plan.
    pub characteristics: Vec<CharacteristicResult>,
    /// The verdict on the part: the worst verdict of the characteristics; invalid if none has one.
    pub verdict: PartVerdict,
}

/// A feature as fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureResult {
    /// Its id in the plan.
    pub id: String,
    /// Its type: `plane`, `circle`, …
    pub kind: &'static str,
    /// Its geometry in the datum frame, or in the part frame if there is no datum frame; `None` for a section and on
    /// failure.
    pub geometry: Option<Geometry>,
    /// Points (for a rim: crossings) used by the fit; 0 for features constructed from others.
    pub n_points: usize,
    /// Points on or inside it that the fit excludes.
    pub n_left_out: usize,
    /// RMS of the residuals, mm.
    pub rms_mm: Option<f64>,
    /// Indices in the cloud of the points used by the fit.
    pub cloud_indices: Vec<u32>,
    /// Findings against the model; empty if it fits.
    pub findings: Vec<Finding>,
    /// Why it could not be fitted.
    pub failure: Option<MeasureError>,
}

/// A characteristic as measured.
#[derive(Debug, Clone, PartialEq)]
pub struct CharacteristicResult {
    /// Its id in the plan.
    pub id: String,
    /// What is measured: `distance`, `position`, …
    pub measure: &'static str,
    /// Unit of value, nominal, limits and uncertainties.
    pub unit: Unit,
    /// The value; `None` if it could not be measured.
    pub value: Option<f64>,
    /// For an angle the signed tilts about two axes, degrees; for a position the signed deviations along x, y, z, mm.
    pub components: Option<[f64; 3]>,
    /// The nominal value; 0 for forms and positions.
    pub nominal: Option<f64>,
    /// Permitted deviations from the nominal value.
    pub limits: Limits,
    /// Value minus nominal.
    pub error: Option<f64>,
    /// Standard uncertainty from the noise of the points.
    pub u_noise: Option<f64>,
    /// Standard uncertainty from errors common to all points; `None` without a calibration.
    pub u_systematic: Option<f64>,
    /// U = 2·√(u_noise² + u_systematic²).
    pub expanded_uncertainty: Option<f64>,
    /// Missing uncertainty contributions; empty if U is complete.
    pub missing: Vec<Missing>,
    /// Findings against the features it depends on, each with the feature's id.
    pub findings: Vec<(String, Finding)>,
    /// The verdict by ISO 14253-1, if there are limits.
    pub verdict: Option<PartVerdict>,
    /// Why it could not be measured.
    pub failure: Option<MeasureError>,
    /// For a surface profile: the comparison with the model.
    pub comparison: Option<Box<Comparison>>,
    /// Why the scan allows no verdict, regardless of the measured value.
    pub invalid_because: Option<String>,
    /// Remarks for the reader, in sentences.
    pub notes: Vec<String>,
    /// The attributes of the characteristic, copied from the plan.
    pub attributes: BTreeMap<String, serde_json::Value>,
}
