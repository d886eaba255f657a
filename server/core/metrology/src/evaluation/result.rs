//! What a plan says of a cloud.

use std::collections::BTreeMap;

use optics::{PartFrame, Rigid};

use crate::evaluation::alignment::DatumFrame;
use crate::evaluation::geometry::Geometry;
use crate::interface::doubts::{Finding, Missing};
use crate::interface::measurement::Unit;
use crate::interface::part_verdict::PartVerdict;
use crate::interface::request::MeasureError;
use crate::interface::verdict::Limits;

/// A cloud measured by a plan.
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
    /// The verdict on the part: the worst of those that have one; invalid if none has.
    pub verdict: PartVerdict,
}

/// A feature as found.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureResult {
    /// Its id in the plan.
    pub id: String,
    /// What it is: `plane`, `circle`, …
    pub kind: &'static str,
    /// Its geometry in the datum frame, in the part frame if there is none; `None` for a section, and if it failed.
    pub geometry: Option<Geometry>,
    /// Points (of a rim: crossings) the fit rests on; 0 for what is made of other features.
    pub n_points: usize,
    /// Points on or inside it that were left out.
    pub n_left_out: usize,
    /// RMS of the points about it, mm.
    pub rms_mm: Option<f64>,
    /// The points it rests on, by their place in the cloud.
    pub cloud_indices: Vec<u32>,
    /// What speaks against it.
    pub findings: Vec<Finding>,
    /// Why it was not found.
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
    /// Of an angle the turns about two axes, degrees, with signs; of a position the deviations along x, y, z, mm.
    pub components: Option<[f64; 3]>,
    /// What it should be; 0 for forms and positions.
    pub nominal: Option<f64>,
    /// How far it may be from that.
    pub limits: Limits,
    /// Value minus nominal.
    pub error: Option<f64>,
    /// Standard uncertainty from the noise of the points.
    pub u_noise: Option<f64>,
    /// Standard uncertainty from all that the points share; absent without a calibration.
    pub u_systematic: Option<f64>,
    /// U = 2·√(u_noise² + u_systematic²).
    pub expanded_uncertainty: Option<f64>,
    /// What U should hold and does not.
    pub missing: Vec<Missing>,
    /// What speaks against the features it rests on, each with the feature's id.
    pub findings: Vec<(String, Finding)>,
    /// The verdict by ISO 14253-1, if there are limits.
    pub verdict: Option<PartVerdict>,
    /// Why it could not be measured.
    pub failure: Option<MeasureError>,
    /// Why it is invalid whatever was measured: the scan allows no verdict.
    pub invalid_because: Option<String>,
    /// What a reader must know, in sentences.
    pub notes: Vec<String>,
    /// As the plan gave them.
    pub attributes: BTreeMap<String, serde_json::Value>,
}
