//! Inspections: a part scanned and measured with a version of a recipe, and its verdict.

mod export;
mod finished;
mod judged;
mod message;
mod run_rules;
#[cfg(test)]
pub(crate) mod sample;
mod sheet;

pub use export::{Export, ExportFormat, ExportPage, csv_table, decimal, dfq_document, local, offset_now};
pub use finished::{VerdictChange, changed_verdicts, inspection_changes, new_inspection};
pub use judged::judged;
pub use message::{CharacteristicMessage, InspectionMessage, RecipeMessage, utc};
pub use run_rules::newly_violated;
pub use sheet::{ReportFormat, inspection_report};

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::events::ViolatedRule;

/// The inspected part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InspectedPart {
    /// Its serial number.
    pub serial: String,
    /// The order it is made for.
    #[serde(default)]
    pub order: Option<String>,
    /// Passed on unchanged to other systems.
    #[serde(default)]
    pub attributes: BTreeMap<String, String>,
}

/// The document of an inspection, as stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InspectionBody {
    /// Digest of the recipe's version.
    pub recipe_digest: String,
    /// The recipe's number, if it has one.
    #[serde(default)]
    pub recipe_number: Option<u32>,
    /// The calibration of the cloud.
    pub calibration_id: String,
    /// Whether the devices were simulated, or a recording.
    pub simulated: bool,
    /// Attributes of the part.
    #[serde(default)]
    pub attributes: BTreeMap<String, String>,
    /// Names of the doors that receive it, as in the recipe; `None`: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outputs: Option<Vec<String>>,
    /// The results, as `sheaf measure --plan --json` prints them.
    pub result: Value,
    /// Differences from the re-evaluated inspection.
    #[serde(default)]
    pub changed: Vec<VerdictChange>,
    /// Run rules that it was the first to violate.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub violated_rules: Vec<ViolatedRule>,
}
