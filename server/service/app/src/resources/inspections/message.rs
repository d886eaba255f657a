//! An inspection as other systems get it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use store::{InspectionRecord, StoreError};
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;
use utoipa::ToSchema;

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
    #[schema(value_type = BTreeMap<String, AttributeMessage>)]
    pub attributes: BTreeMap<String, Value>,
}

/// What an attribute can be.
#[derive(ToSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "only its schema is of use")]
enum AttributeMessage {
    /// A text.
    Text(String),
    /// A number.
    Number(f64),
    /// Yes or no.
    Flag(bool),
}

impl CharacteristicMessage {
    /// Lower and upper limit as values, in `unit`.
    pub fn limits(&self) -> (Option<f64>, Option<f64>) {
        let nominal = self.nominal.unwrap_or(0.0);
        (self.lower.map(|lower| nominal + lower), self.upper.map(|upper| nominal + upper))
    }

    /// The value as a point of a control chart: a gap if it was not measured or is invalid.
    pub fn charted(&self) -> Option<f64> {
        self.value.filter(|_| self.verdict.as_deref() != Some("invalid"))
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

/// Milliseconds since 1970 as RFC 3339: `2026-11-26T15:52:30.123Z`; empty for times beyond the year 9999.
pub fn utc(at_ms: i64) -> String {
    let at = OffsetDateTime::from_unix_timestamp_nanos(i128::from(at_ms) * 1_000_000).ok();
    at.and_then(|at| at.format(&Rfc3339).ok()).unwrap_or_default()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde_json::json;

    use super::*;

    fn record(characteristics: &Value) -> InspectionRecord {
        let body = json!({
            "recipe_digest": "d", "recipe_number": 12, "calibration_id": "c", "simulated": true,
            "attributes": { "line": "4" }, "result": { "characteristics": characteristics },
        });
        InspectionRecord {
            id: "i".to_owned(),
            seq: 7,
            serial: "S1".to_owned(),
            order_number: None,
            recipe_id: "bracket".to_owned(),
            recipe_version: 3,
            verdict: "not_ok".to_owned(),
            scan_id: None,
            re_evaluated_from: None,
            job_id: None,
            body,
            created_at_ms: 1_795_708_350_123,
        }
    }

    #[test]
    fn an_inspection_is_read_as_stored() {
        let stored = json!([{
            "id": "h", "measure": "step", "unit": "mm", "nominal": 8.9, "lower": -0.05, "upper": 0.1, "value": 9.02,
            "expanded_uncertainty": 0.01, "coverage_factor": 2, "verdict": "not_ok", "reason": null,
            "attributes": { "K2001": "1", "line": 4 }, "notes": [],
        }]);
        let message = InspectionMessage::try_from(record(&stored)).unwrap();
        assert_eq!((message.seq, message.recipe.version, message.recipe.number), (7, 3, Some(12)));
        assert_eq!(message.inspected_at, "2026-11-26T15:52:30.123Z");
        let result = &message.results[0];
        assert_eq!((result.value, result.verdict.as_deref()), (Some(9.02), Some("not_ok")));
        assert_eq!(result.attributes["line"], 4);
        let (lower, upper) = result.limits();
        assert!((lower.unwrap() - 8.85).abs() < 1e-12 && (upper.unwrap() - 9.0).abs() < 1e-12);
    }

    #[test]
    fn an_inspection_that_cannot_be_read_is_a_damaged_record() {
        let error = InspectionMessage::try_from(record(&json!([{ "id": 1 }]))).unwrap_err();
        assert!(matches!(error, StoreError::DamagedRecord { kind: "inspection", .. }), "{error}");
    }
}
