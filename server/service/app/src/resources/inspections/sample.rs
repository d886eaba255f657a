//! An inspection for tests.

use crate::resources::inspections::{CharacteristicMessage, InspectionMessage, RecipeMessage};

/// An inspection with a two-sided and a one-sided characteristic.
pub fn inspection() -> InspectionMessage {
    let step = CharacteristicMessage {
        id: "Step".to_owned(),
        measure: "step".to_owned(),
        unit: "mm".to_owned(),
        nominal: Some(8.9),
        lower: Some(-0.05),
        upper: Some(0.1),
        value: Some(8.912),
        expanded_uncertainty: Some(0.01),
        coverage_factor: 2.0,
        verdict: Some("ok".to_owned()),
        reason: None,
        attributes: [].into(),
    };
    let flatness = CharacteristicMessage {
        id: "Flatness".to_owned(),
        measure: "flatness".to_owned(),
        nominal: None,
        lower: None,
        upper: Some(0.05),
        value: Some(0.021),
        expanded_uncertainty: Some(0.004),
        ..step.clone()
    };
    InspectionMessage {
        id: "01J".to_owned(),
        seq: 812,
        serial: "S1".to_owned(),
        order: Some("A-7".to_owned()),
        recipe: RecipeMessage { id: "bracket".to_owned(), version: 7, digest: "00".to_owned(), number: Some(12) },
        verdict: "ok".to_owned(),
        simulated: false,
        results: vec![step, flatness],
        scan_id: Some("scan-1".to_owned()),
        calibration_id: "calibration-1".to_owned(),
        re_evaluated_from: None,
        attributes: [("line".to_owned(), "2".to_owned())].into(),
        inspected_at: "2025-11-22T13:03:07Z".to_owned(),
        inspected_at_ms: 1_763_816_587_000,
    }
}
