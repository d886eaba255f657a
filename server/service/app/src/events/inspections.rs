//! Bodies of the events of recipes and inspections.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::initiator::Initiator;

/// A new version of a recipe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecipePublished {
    /// The version.
    pub version: i64,
    /// SHA-256 of its canonical content, hexadecimal.
    pub digest: String,
    /// Number by which a PLC selects it.
    pub number: Option<u32>,
    /// Why it was published.
    pub reason: String,
    /// The earlier version that it restores.
    pub restored_from: Option<i64>,
    /// Who did it.
    pub actor: String,
}

/// A part that was inspected.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct InspectionFinished {
    /// Position among all inspections, from 1 without gaps.
    pub seq: i64,
    /// Serial number of the part.
    pub serial: String,
    /// The order it was made for.
    pub order: Option<String>,
    /// Recipe and version: `bracket@7`.
    pub recipe: String,
    /// The recipe's number, if it has one.
    pub recipe_number: Option<u32>,
    /// Digest of the recipe's version.
    pub recipe_digest: String,
    /// `ok`, `not_ok`, `undecided` or `invalid`.
    pub verdict: String,
    /// The scan.
    pub scan_id: Option<String>,
    /// The calibration of its cloud.
    pub calibration_id: String,
    /// Whether the devices were simulated, or a recording.
    pub simulated: bool,
    /// The inspection that this one re-evaluates.
    pub re_evaluated_from: Option<String>,
    /// Names of the doors that receive it; absent: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outputs: Option<Vec<String>>,
}

/// A run rule that an inspection was the first to violate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ViolatedRule {
    /// Id of the characteristic in the plan.
    pub characteristic: String,
    /// Number of the rule (Nelson 1 to 8).
    pub rule: u8,
    /// The inspection of the first point of the pattern.
    pub first_inspection_id: String,
    /// Number of points of the pattern so far.
    pub n_points: usize,
    /// The value that completed it, in `unit`.
    pub value: f64,
    /// Centre line of the chart then, in `unit`.
    pub centre: f64,
    /// σ within then, from the moving ranges, in `unit`.
    pub sigma: f64,
    /// `mm` or `°`.
    pub unit: String,
}

/// A violated run rule of a control chart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RuleViolated {
    /// Recipe and version: `bracket@7`.
    pub recipe: String,
    /// Serial number of the part.
    pub serial: String,
    /// The rule.
    #[serde(flatten)]
    pub violated: ViolatedRule,
    /// Names of the doors that receive it; absent: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outputs: Option<Vec<String>>,
}

/// A hold of the inspection queue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct InspectionsHeld {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Why.
    pub reason: Option<String>,
}
