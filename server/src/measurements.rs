//! Measurements on stored scans: the cloud, its calibration, `metrology::measure`, a record.

use metrology::{MeasureRequest, measure};
use optics::Calibration;
use scanning::Cloud;
use serde_json::{Value, json};
use store::{Change, MeasurementRecord, ScanRecord, ScanState};

use crate::failure::Failure;
use crate::ledger::event;
use crate::problem::Problem;
use crate::stored_scan::new_id;
use crate::tables::measurement_json;
use crate::wall_clock::now_ms;

/// The word in place of a verdict for scans that lost frames: neither pass nor fail.
pub const INVALID: &str = "invalid";

/// Measures on the cloud of a scan; takes seconds.
///
/// # Errors
/// A problem in the words of the measurement.
pub fn measurement(
    scan: &ScanRecord,
    cloud: &Cloud,
    calibration: &Calibration,
    request: &MeasureRequest,
) -> Result<MeasurementRecord, Problem> {
    let measurement = measure(cloud, Some(calibration), request).map_err(Failure::from)?;
    let mut result = measurement_json(&measurement);
    result["calibration_id"] = json!(scan.calibration_id);
    result["scan_state"] = json!(scan.state);
    let doubt = match scan.state {
        ScanState::Complete => None,
        ScanState::Partial => Some("the scan was stopped before its end: parts of the surface are missing"),
        ScanState::Invalid => {
            result["verdict"] = json!(INVALID);
            Some("frames of the scan were lost: the value is no base of a verdict; scan again")
        }
    };
    if let (Some(doubt), Some(notes)) = (doubt, result["notes"].as_array_mut()) {
        notes.push(json!(doubt));
    }
    Ok(MeasurementRecord {
        id: new_id(),
        scan_id: scan.id.clone(),
        request: request_json(request),
        result,
        created_at_ms: now_ms(),
    })
}

/// What stores a measurement.
pub fn changes(record: &MeasurementRecord) -> Vec<Change> {
    let told = ["tool", "value", "unit", "expanded_uncertainty", "verdict"];
    let mut body = json!({ "scan_id": record.scan_id });
    for key in told {
        body[key] = record.result[key].clone();
    }
    vec![Change::InsertMeasurement(record.clone()), event("measurement.made", &record.id, body)]
}

fn request_json(request: &MeasureRequest) -> Value {
    json!({
        "tool": request.tool.name(),
        "nominal_mm": request.nominal_mm,
        "tolerance_mm": request.tolerance_mm,
        "seed": request.seed,
        "region_mm": request.region.map(|region| json!({ "min": region.min_mm, "max": region.max_mm })),
    })
}
