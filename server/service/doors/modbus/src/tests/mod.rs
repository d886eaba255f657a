//! The server over TCP on a scripted station, with PLCs of other authors: the client of tokio-modbus, and pymodbus.
//!
//! What they do not show: how the use cases of the service act, which its own tests show, and the times of a network.

mod plant;
mod tcp;
mod witness;

use std::collections::BTreeMap;

use app::doors::{CharacteristicMessage, Delivery, EventRecord, InspectionMessage, RecipeMessage};

/// Characteristics of a result: as many as one request reads with everything else.
pub const N_CHARACTERISTICS: usize = 3;

/// A result whose values all follow from its number, so that a mixture of two is noticed.
pub fn inspection(seq: i64, serial: &str) -> InspectionMessage {
    let one = |idx: usize| CharacteristicMessage {
        id: format!("c{idx}"),
        measure: "distance".to_owned(),
        unit: "mm".to_owned(),
        nominal: None,
        lower: None,
        upper: None,
        value: Some(seq as f64 * 1e-4),
        expanded_uncertainty: Some(0.01),
        coverage_factor: 2.0,
        verdict: Some("ok".to_owned()),
        reason: None,
        attributes: BTreeMap::new(),
    };
    InspectionMessage {
        id: format!("inspection-{seq}"),
        seq,
        serial: serial.to_owned(),
        order: None,
        recipe: RecipeMessage { id: "bracket".to_owned(), version: 7, digest: String::new(), number: Some(12) },
        verdict: "not_ok".to_owned(),
        simulated: false,
        results: (0..N_CHARACTERISTICS).map(one).collect(),
        scan_id: None,
        calibration_id: String::new(),
        re_evaluated_from: None,
        attributes: BTreeMap::new(),
        inspected_at: String::new(),
        inspected_at_ms: 1_764_164_142_100,
    }
}

/// The event with that result.
pub fn delivery(event_seq: i64, inspection: InspectionMessage) -> Delivery {
    let event = EventRecord {
        seq: event_seq,
        kind: "inspection.finished".to_owned(),
        subject: inspection.id.clone(),
        body: serde_json::json!({ "recipe": "bracket@7", "re_evaluated_from": null }),
        at_ms: inspection.inspected_at_ms,
    };
    Delivery::new(event, Some(inspection))
}
