//! The content of a recipe.

use std::collections::BTreeMap;

use metrology::Plan;
use serde::{Deserialize, Serialize};

use crate::resources::scan_run::ScanSettings;

/// How a part is scanned and measured, and its limits. It contains no calibration: an inspection uses the active one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Display name.
    pub name: String,
    /// Number by which a PLC selects it, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub number: Option<u32>,
    /// A regular expression that must match the whole serial number: the recipe is selected for parts that match.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial_pattern: Option<String>,
    /// How the part is scanned.
    pub scan: ScanSettings,
    /// What is measured, and within which limits.
    pub plan: Plan,
    /// Names of the doors that receive its results; `None`: every door that delivers inspections.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outputs: Option<Vec<String>>,
    /// Passed on unchanged to other systems.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub attributes: BTreeMap<String, String>,
}
