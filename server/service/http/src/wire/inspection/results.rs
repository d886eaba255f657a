//! The result of a plan on the wire: read from the stored record, which has the form that `sheaf measure --plan --json`
//! prints.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

use crate::wire::inspection::comparison::ComparisonDto;
use crate::wire::measurement::measurement_results::FindingKindDto;
use crate::wire::measurement::measurements::VerdictDto;

/// Frame of the geometry of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlanFrameDto {
    /// The datum frame of the plan.
    Datum,
    /// The frame of the scan: there is no datum frame.
    Part,
}

/// Results of a plan on a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanResultDto {
    /// The frame of all geometry.
    pub frame: PlanFrameDto,
    /// The datum frame, if there is one.
    pub datum_from_part: Option<PoseDto>,
    /// Why there is no datum frame.
    pub alignment_failure: Option<String>,
    /// The features, in the order of the plan.
    pub features: Vec<PlanFeatureDto>,
    /// The characteristics, in the order of the plan.
    pub characteristics: Vec<CharacteristicResultDto>,
}

/// A rigid motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PoseDto {
    /// Rows of the rotation matrix.
    #[schema(min_items = 3, max_items = 3)]
    pub rotation: [[f64; 3]; 3],
    /// Translation, mm.
    #[schema(min_items = 3, max_items = 3)]
    pub translation_mm: [f64; 3],
}

/// A measured characteristic; values are in `unit`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CharacteristicResultDto {
    /// Its id in the plan.
    pub id: String,
    /// What is measured: `step`, `diameter`, `position`, …
    pub measure: String,
    /// `mm` or `°`.
    pub unit: String,
    /// The actual value; absent if it could not be measured.
    pub value: Option<f64>,
    /// For an angle: rotations about two axes; for a position: deviations along x, y, z.
    #[schema(min_items = 3, max_items = 3)]
    pub components: Option<[f64; 3]>,
    /// Nominal value.
    pub nominal: Option<f64>,
    /// Smallest permitted deviation from nominal.
    pub lower: Option<f64>,
    /// Largest permitted deviation from nominal.
    pub upper: Option<f64>,
    /// Value minus nominal.
    pub error: Option<f64>,
    /// Standard uncertainty due to the noise of the points.
    pub u_noise: Option<f64>,
    /// Standard uncertainty due to effects common to the points.
    pub u_systematic: Option<f64>,
    /// Expanded uncertainty U: `coverage_factor` times the standard uncertainty.
    pub expanded_uncertainty: Option<f64>,
    /// Coverage factor k.
    pub coverage_factor: f64,
    /// Whether U contains all contributions.
    pub uncertainty_complete: bool,
    /// Names of the contributions missing from U.
    pub uncertainty_missing: Vec<String>,
    /// Findings that question the features used.
    pub findings: Vec<PlanFindingDto>,
    /// The verdict according to ISO 14253-1; absent without limits.
    pub verdict: Option<VerdictDto>,
    /// Why it is undecided or invalid, in a sentence.
    #[serde(default)]
    pub reason: Option<String>,
    /// Why it could not be measured.
    pub failure: Option<String>,
    /// Notes, in sentences.
    pub notes: Vec<String>,
    /// For a surface profile: the comparison with the CAD model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comparison: Option<ComparisonDto>,
    /// Attributes from the plan, unchanged.
    pub attributes: BTreeMap<String, AttributeDto>,
}

/// Value of an attribute: a text, a number, true or false.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AttributeDto(pub Value);

impl PartialSchema for AttributeDto {
    fn schema() -> RefOr<Schema> {
        let plain = json!({ "type": ["string", "number", "boolean"], "description": "Value of an attribute." });
        serde_json::from_value(plain).expect("this is a schema")
    }
}

impl ToSchema for AttributeDto {}

/// A finding that questions a feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanFindingDto {
    /// The feature; absent in the list of a feature itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub feature: Option<String>,
    /// What it questions.
    pub kind: FindingKindDto,
    /// Its text.
    pub text: String,
}

/// Kind of a feature of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlanFeatureKindDto {
    /// A plane.
    Plane,
    /// A sphere.
    Sphere,
    /// A cylinder.
    Cylinder,
    /// A round rim of a plane.
    Circle,
    /// A rim of a plane in the shape of a slot.
    Slot,
    /// A straight rim of a plane.
    Edge,
    /// The points of a slice.
    Section,
    /// A line that follows from other features.
    Line,
    /// A point that follows from other features.
    Point,
}

/// A fitted feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanFeatureDto {
    /// Its id in the plan.
    pub id: String,
    /// Its kind.
    pub kind: PlanFeatureKindDto,
    /// Its geometry; absent for a section, and if it was not found.
    pub geometry: Option<GeometryDto>,
    /// Number of points used in the fit (for a rim: edge crossings).
    pub n_points: usize,
    /// Points on or inside it that were not used.
    pub n_left_out: usize,
    /// RMS distance of the points from it.
    pub rms_mm: Option<f64>,
    /// Findings that question it.
    pub findings: Vec<PlanFindingDto>,
    /// Why it was not found.
    pub failure: Option<String>,
}

/// The geometry of a feature, mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum GeometryDto {
    /// A plane.
    Plane {
        /// A point on it.
        point_mm: [f64; 3],
        /// Unit normal.
        normal: [f64; 3],
    },
    /// A sphere.
    Sphere {
        /// Its centre.
        centre_mm: [f64; 3],
        /// Its radius.
        radius_mm: f64,
    },
    /// A cylinder.
    Cylinder {
        /// A point on the axis.
        point_mm: [f64; 3],
        /// Unit direction of the axis.
        axis: [f64; 3],
        /// Its radius.
        radius_mm: f64,
    },
    /// A circle.
    Circle {
        /// Its centre.
        centre_mm: [f64; 3],
        /// Unit normal of its plane.
        normal: [f64; 3],
        /// Its radius.
        radius_mm: f64,
    },
    /// A slot.
    Slot {
        /// Its centre.
        centre_mm: [f64; 3],
        /// Unit normal of its plane.
        normal: [f64; 3],
        /// Unit direction of its long axis.
        direction: [f64; 3],
        /// Length over both ends.
        length_mm: f64,
        /// Width.
        width_mm: f64,
    },
    /// A line.
    Line {
        /// A point on it.
        point_mm: [f64; 3],
        /// Unit direction.
        direction: [f64; 3],
    },
    /// A point.
    Point {
        /// Its position.
        at_mm: [f64; 3],
    },
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_stored_result_is_returned_in_full() {
        let geometries = [
            json!({ "kind": "plane", "point_mm": [0.0, 1.0, 9.0], "normal": [0.0, 0.0, -1.0] }),
            json!({ "kind": "sphere", "centre_mm": [0.0, 1.0, 9.0], "radius_mm": 18.9 }),
            json!({ "kind": "cylinder", "point_mm": [0.0, 1.0, 9.0], "axis": [1.0, 0.0, 0.0], "radius_mm": 2.0 }),
            json!({ "kind": "circle", "centre_mm": [0.0, 1.0, 9.0], "normal": [0.0, 0.0, -1.0], "radius_mm": 5.0 }),
            json!({ "kind": "slot", "centre_mm": [0.0, 1.0, 9.0], "normal": [0.0, 0.0, -1.0],
                "direction": [1.0, 0.0, 0.0], "length_mm": 9.0, "width_mm": 3.0 }),
            json!({ "kind": "line", "point_mm": [0.0, 1.0, 9.0], "direction": [1.0, 0.0, 0.0] }),
            json!({ "kind": "point", "at_mm": [0.0, 1.0, 9.0] }),
            Value::Null,
        ];
        let features: Vec<Value> = geometries
            .into_iter()
            .map(|geometry| {
                json!({ "id": "f", "kind": "plane", "geometry": geometry, "n_points": 9, "n_left_out": 1,
                    "rms_mm": 0.02, "findings": [{ "kind": "short_arc", "text": "short" }], "failure": null })
            })
            .collect();
        let comparison = json!({
            "verdict": "not_ok", "tolerance_mm": 0.1,
            "datum_from_part": { "rotation": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                "translation_mm": [1.0, 2.0, 3.0] },
            "locked": ["the rotation about z"], "fit_rms_mm": 0.01, "n_points": 9, "n_beyond": 1, "mean_mm": 0.001,
            "rms_mm": 0.01, "std_mm": 0.01, "range_mm": [-0.1, 0.2],
            "percentiles": { "p2_5_mm": -0.02, "p50_mm": 0.0, "p97_5_mm": 0.02 },
            "area_mm2": 900.0, "covered_mm2": 800.0, "out_of_tolerance_mm2": 2.0, "surely_out_of_tolerance_mm2": 1.0,
            "worst": [{ "at_mm": [1.0, 2.0, 3.0], "deviation_mm": 0.2, "expanded_uncertainty_mm": 0.01,
                "n_points": 7 }],
            "uncertainty_complete": true, "uncertainty_missing": [], "notes": ["a note"],
        });
        let characteristic = json!({
            "id": "h", "measure": "step", "unit": "mm", "value": 8.9, "components": [0.1, 0.2, 0.3], "nominal": 8.9,
            "lower": -0.05, "upper": null, "error": 0.0, "u_noise": 0.001, "u_systematic": 0.002,
            "expanded_uncertainty": 0.004, "coverage_factor": 2.0, "uncertainty_complete": false,
            "uncertainty_missing": ["calibration"],
            "findings": [{ "feature": "f", "kind": "short_arc", "text": "short" }], "verdict": "undecided",
            "reason": "U is incomplete", "failure": null, "notes": ["a note"], "comparison": comparison,
            "attributes": { "K2001": "4", "line": 4, "share": 0.5, "critical": true },
        });
        let pose = json!({ "rotation": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            "translation_mm": [1.0, 2.0, 3.0] });
        let stored = json!({ "frame": "datum", "datum_from_part": pose, "alignment_failure": null,
            "features": features, "characteristics": [characteristic] });
        let parsed: PlanResultDto = serde_json::from_value(stored.clone()).unwrap();
        assert_eq!(serde_json::to_value(parsed).unwrap(), stored);
    }
}
