//! An inspection as doors deliver it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use store::{InspectionRecord, StoreError};
use utoipa::ToSchema;

use crate::doors::delivery::utc;
use crate::resources::inspections::InspectionBody;

/// An inspection of a part with all its characteristics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct InspectionMessage {
    /// Its id.
    pub id: String,
    /// Position among all inspections, from 1 without gaps.
    pub seq: i64,
    /// Serial number of the part.
    pub serial: String,
    /// The order it was made for.
    pub order: Option<String>,
    /// The recipe used.
    pub recipe: RecipeMessage,
    /// The verdict on the part: `ok`, `not_ok`, `undecided` or `invalid`. Accept only `ok`.
    pub verdict: String,
    /// Whether the devices were simulated, or a recording: no verdict on a real part.
    pub simulated: bool,
    /// The characteristics, in the order of the plan.
    pub results: Vec<CharacteristicMessage>,
    /// The scan; absent if it was deleted.
    pub scan_id: Option<String>,
    /// The calibration of its cloud.
    pub calibration_id: String,
    /// The inspection that this one re-evaluates.
    pub re_evaluated_from: Option<String>,
    /// Attributes of the part, as given with the order.
    pub attributes: BTreeMap<String, String>,
    /// Time of the verdict, UTC.
    pub inspected_at: String,
    /// The same in ms since 1970.
    pub inspected_at_ms: i64,
}

/// The version of a recipe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecipeMessage {
    /// Its id.
    pub id: String,
    /// The version.
    pub version: i64,
    /// SHA-256 of its canonical content, hexadecimal.
    pub digest: String,
    /// The recipe's number, if it has one.
    pub number: Option<u32>,
}

/// A measured characteristic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CharacteristicMessage {
    /// Its id in the plan.
    pub id: String,
    /// What is measured: `distance`, `flatness`, …
    pub measure: String,
    /// `mm` or `°`.
    pub unit: String,
    /// Nominal value, in `unit`.
    pub nominal: Option<f64>,
    /// Lower limit as a deviation from the nominal value, in `unit`.
    pub lower: Option<f64>,
    /// Upper limit as a deviation from the nominal value, in `unit`.
    pub upper: Option<f64>,
    /// The value, in `unit`; absent if it could not be measured.
    pub value: Option<f64>,
    /// Expanded uncertainty, in `unit`.
    pub expanded_uncertainty: Option<f64>,
    /// Its coverage factor.
    pub coverage_factor: f64,
    /// `ok`, `not_ok`, `undecided` or `invalid`; absent without limits.
    pub verdict: Option<String>,
    /// Why the verdict is neither `ok` nor `not_ok`.
    pub reason: Option<String>,
    /// Attributes of the characteristic, as in the plan.
    #[serde(default)]
    pub attributes: BTreeMap<String, String>,
}

impl CharacteristicMessage {
    /// Lower and upper limit as values, in `unit`.
    pub fn limits(&self) -> (Option<f64>, Option<f64>) {
        let nominal = self.nominal.unwrap_or(0.0);
        (self.lower.map(|lower| nominal + lower), self.upper.map(|upper| nominal + upper))
    }
}

impl TryFrom<InspectionRecord> for InspectionMessage {
    type Error = StoreError;

    fn try_from(record: InspectionRecord) -> Result<Self, StoreError> {
        let damaged = || StoreError::DamagedRecord { kind: "inspection", id: record.id.clone() };
        let body: InspectionBody = serde_json::from_value(record.body).map_err(|_| damaged())?;
        let results = serde_json::from_value(body.result["characteristics"].clone()).map_err(|_| damaged())?;
        Ok(Self {
            seq: record.seq,
            serial: record.serial,
            order: record.order_number,
            recipe: RecipeMessage {
                id: record.recipe_id,
                version: record.recipe_version,
                digest: body.recipe_digest,
                number: body.recipe_number,
            },
            verdict: record.verdict,
            simulated: body.simulated,
            results,
            scan_id: record.scan_id,
            calibration_id: body.calibration_id,
            re_evaluated_from: record.re_evaluated_from,
            attributes: body.attributes,
            inspected_at: utc(record.created_at_ms),
            inspected_at_ms: record.created_at_ms,
            id: record.id,
        })
    }
}
