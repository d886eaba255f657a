//! An inspection for tests, the same as in the tests of the doors.

use crate::resources::inspections::InspectionMessage;

/// An inspection with a two-sided and a one-sided characteristic.
pub fn inspection() -> InspectionMessage {
    let sample = include_str!("../../../../../../tests/golden/doors/inspection.json");
    serde_json::from_str(sample).unwrap()
}
