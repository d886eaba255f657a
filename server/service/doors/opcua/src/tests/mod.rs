//! The server on a scripted station, with a client of another author: asyncua in Python.
//!
//! What they do not show: how the use cases of the service act, which its own tests show.

mod health;
mod plant;
mod settings;
mod witness;

use std::collections::BTreeMap;

use app::doors::{CharacteristicMessage, InspectionMessage, RecipeMessage};

/// A result of two characteristics: one in tolerance, one that could not be measured.
pub fn inspection(seq: i64, serial: &str) -> InspectionMessage {
    let one = |id: &str, value, expanded_uncertainty, verdict: &str| CharacteristicMessage {
        id: id.to_owned(),
        measure: "distance".to_owned(),
        unit: "mm".to_owned(),
        nominal: Some(8.9),
        lower: Some(-0.05),
        upper: None,
        value,
        expanded_uncertainty,
        coverage_factor: 2.0,
        verdict: Some(verdict.to_owned()),
        reason: None,
        attributes: BTreeMap::new(),
    };
    InspectionMessage {
        id: format!("inspection-{seq}"),
        seq,
        serial: serial.to_owned(),
        order: None,
        recipe: RecipeMessage {
            id: "bracket".to_owned(),
            version: 7,
            digest: "00ff".to_owned(),
            number: Some(12),
        },
        verdict: "invalid".to_owned(),
        simulated: true,
        results: vec![one("h", Some(8.912), Some(0.01), "ok"), one("w", Some(1.0), None, "invalid")],
        scan_id: None,
        calibration_id: "c".to_owned(),
        re_evaluated_from: None,
        attributes: BTreeMap::new(),
        inspected_at: String::new(),
        inspected_at_ms: 1_764_164_142_100,
    }
}
