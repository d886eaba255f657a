//! A measurement plan as a document.

use std::borrow::Cow;

use remedy::Remedy;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::plan::alignment::Alignment;
use crate::plan::characteristic::Characteristic;
use crate::plan::check::PlanError;
use crate::plan::feature::Feature;

/// The version of the document.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum PlanFormat {
    /// The first.
    #[default]
    #[serde(rename = "sheaf-plan/1")]
    V1,
}

/// Features, the alignment that defines the datum frame by some of them, and the characteristics evaluated in it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Version of this document.
    pub format: PlanFormat,
    /// Display name.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Seed of the random choices of the search; the same seed gives the same result.
    #[serde(default = "first_seed")]
    pub seed: u64,
    /// Features of the part; a feature may depend on features above it.
    pub features: Vec<Feature>,
    /// Alignment of the part; without it, regions and directions are in the frame of the scan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alignment: Option<Alignment>,
    /// Characteristics to measure and judge.
    pub characteristics: Vec<Characteristic>,
}

fn first_seed() -> u64 {
    1
}

/// Why a document is not a valid plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanDocumentError {
    /// It is not JSON, or does not match the schema.
    #[error("the plan cannot be read")]
    Json {
        /// The cause, with line and column.
        #[source]
        cause: serde_json::Error,
    },
    /// It is inconsistent.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

impl Remedy for PlanDocumentError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        match self {
            Self::Json { .. } => Some("see server/docs/schemas/plan.schema.json".into()),
            Self::Plan(error) => error.remedy(),
        }
    }
}

impl Plan {
    /// Reads a plan and checks its consistency.
    ///
    /// # Errors
    /// [`PlanDocumentError`] with the line and column, or the part of the plan that is wrong.
    pub fn from_json(text: &str) -> Result<Self, PlanDocumentError> {
        let plan: Self = serde_json::from_str(text).map_err(|cause| PlanDocumentError::Json { cause })?;
        plan.check()?;
        Ok(plan)
    }

    /// The JSON schema of the document.
    pub fn schema() -> serde_json::Value {
        schemars::schema_for!(Self).to_value()
    }
}
