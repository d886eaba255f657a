//! Measurements on stored scans: the cloud, its calibration, `metrology::measure`, a record.

mod check;
pub mod parts;
pub mod plan;
mod surface_region;

pub use crate::resources::scan_run::{MeasureInput, ScanPurpose};
pub use check::check_measurements;

use crate::events::{Event, MeasurementCreated, event};
use metrology::{MeasureError, MeasureRequest, Measurement, PartVerdict, Region, Tool, measure};
use optics::Calibration;
use scanning::Cloud;
use serde_json::{Value, json};
use station::wall_clock::now_ms;
use store::{Change, MeasurementRecord, ScanRecord, ScanState};

use crate::error::{AppError, ErrorKind};
use crate::resources::measurements::surface_region::surface_region;
use crate::resources::stored_scan::new_id;
use crate::resources::watches::why_invalid;
use pipeline::Failure;
use report::tables::measurement_json;

impl MeasureInput {
    /// The request for `metrology`. Flatness is compared with zero: its tolerance needs no nominal value.
    ///
    /// # Errors
    /// A problem with the place in the input: an unknown tool, a tolerance without a nominal value, invalid numbers.
    pub fn request(&self) -> Result<MeasureRequest, AppError> {
        let refused = |field: &str, detail: String, remedy: &str| {
            AppError::new(ErrorKind::Impossible, detail).at(format!("/{field}")).remedy(remedy)
        };
        let tool = Tool::from_name(&self.tool).ok_or_else(|| {
            refused("tool", format!("unknown tool \"{}\"", self.tool), "use one of the tools in the API document")
        })?;
        let zero = (tool == Tool::Flatness && self.tolerance_mm.is_some()).then_some(0.0);
        let nominal_mm = self.nominal_mm.or(zero);
        if self.tolerance_mm.is_some() && nominal_mm.is_none() {
            return Err(refused(
                "tolerance_mm",
                "a tolerance needs a nominal value".to_owned(),
                "also give nominal_mm",
            ));
        }
        if let Some(value) = self.nominal_mm.filter(|value| !value.is_finite()) {
            return Err(refused("nominal_mm", format!("nominal_mm is {value}"), "give a number"));
        }
        if let Some(value) = self.tolerance_mm.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(refused("tolerance_mm", format!("tolerance_mm is {value}"), "give a number above 0"));
        }
        let region = self
            .region_mm
            .map(|[x, y, z, other_x, other_y, other_z]| Region::between([x, y, z], [other_x, other_y, other_z]));
        Ok(MeasureRequest {
            nominal_mm,
            tolerance_mm: self.tolerance_mm,
            seed: self.seed.unwrap_or(1),
            region,
            ..MeasureRequest::new(tool)
        })
    }
}

/// Measures on the cloud of a scan; takes seconds. A characteristic with a tolerance that cannot be measured gets the
/// verdict invalid.
///
/// # Errors
/// A problem: an impossible request, a calibration of another station, or, without a tolerance, a feature that cannot be
/// found.
pub fn measurement(
    scan: &ScanRecord,
    cloud: &Cloud,
    calibration: &Calibration,
    input: &MeasureInput,
) -> Result<MeasurementRecord, AppError> {
    let request = input.request()?;
    match measure(cloud, Some(calibration), &request) {
        Ok(measurement) => Ok(record(scan, input, &request, judged(scan, result_json(cloud, &measurement)))),
        Err(error @ (MeasureError::BadNumber { .. } | MeasureError::CalibrationMismatch { .. })) => {
            Err(Failure::from(error).into())
        }
        Err(error) if request.tolerance_mm.is_none() => Err(Failure::from(error).into()),
        Err(error) => Ok(not_measured(scan, input, &request, &AppError::from(Failure::from(error)))),
    }
}

/// The features that a tool finds in a cloud, as JSON with their regions; takes seconds.
///
/// # Errors
/// A problem: an impossible request, a calibration of another station, or a feature that cannot be found.
pub fn features_found(
    cloud: &Cloud,
    calibration: &Calibration,
    input: &MeasureInput,
) -> Result<Vec<Value>, AppError> {
    let found = measure(cloud, Some(calibration), &input.request()?).map_err(Failure::from)?;
    Ok(result_json(cloud, &found)["features"].as_array().cloned().unwrap_or_default())
}

/// The result with the region of each feature.
fn result_json(cloud: &Cloud, measurement: &Measurement) -> Value {
    let mut result = measurement_json(measurement);
    let features = result["features"].as_array_mut().into_iter().flatten();
    for (feature_json, feature) in features.zip(&measurement.features) {
        feature_json["region"] = surface_region(cloud, feature);
    }
    result
}

/// The same for measurements in a scan job: a failure to measure is a verdict as well.
///
/// # Errors
/// Only for a request that should have been refused earlier.
pub fn planned_measurement(
    scan: &ScanRecord,
    cloud: &Cloud,
    calibration: &Calibration,
    input: &MeasureInput,
) -> Result<MeasurementRecord, AppError> {
    let request = input.request()?;
    Ok(measurement(scan, cloud, calibration, input)
        .unwrap_or_else(|problem| not_measured(scan, input, &request, &problem)))
}

/// The result, adjusted to the state of the scan.
fn judged(scan: &ScanRecord, mut result: Value) -> Value {
    let doubt = match scan.state {
        ScanState::Complete => None,
        ScanState::Partial => Some("the scan was stopped early: parts of the surface are missing".to_owned()),
        ScanState::Invalid => {
            result["verdict"] = json!(PartVerdict::Invalid.name());
            Some(format!("the scan is invalid ({}): no verdict possible; scan again", why_invalid(scan)))
        }
    };
    if let (Some(doubt), Some(notes)) = (doubt, result["notes"].as_array_mut()) {
        notes.push(json!(doubt));
    }
    result
}

/// The record of a failed measurement: no value, and the reason.
fn not_measured(
    scan: &ScanRecord,
    input: &MeasureInput,
    request: &MeasureRequest,
    problem: &AppError,
) -> MeasurementRecord {
    let unit = if request.tool == Tool::Angle { "°" } else { "mm" };
    let result = json!({
        "tool": request.tool.name(),
        "unit": unit,
        "value": null,
        "nominal": request.nominal_mm,
        "error": null,
        "u_noise": null,
        "u_systematic": null,
        "expanded_uncertainty": null,
        "coverage_factor": 2,
        "tolerance": request.tolerance_mm,
        "verdict": PartVerdict::Invalid.name(),
        "errors": null,
        "per_order": [],
        "features": [],
        "notes": [format!("not measurable: {}", problem.detail)],
    });
    record(scan, input, request, result)
}

fn record(
    scan: &ScanRecord,
    input: &MeasureInput,
    request: &MeasureRequest,
    mut result: Value,
) -> MeasurementRecord {
    result["name"] = json!(input.name);
    result["calibration_id"] = json!(scan.calibration_id);
    result["scan_state"] = json!(scan.state);
    MeasurementRecord {
        id: new_id(),
        scan_id: scan.id.clone(),
        request: request_json(input, request),
        result,
        created_at_ms: now_ms(),
    }
}

/// The changes that store a measurement of a job.
pub fn changes(record: &MeasurementRecord) -> Vec<Change> {
    changes_by(record, None)
}

/// The changes that store a measurement requested by `actor`.
pub fn changes_by(record: &MeasurementRecord, actor: Option<&str>) -> Vec<Change> {
    let (result, text) = (&record.result, |value: &Value| value.as_str().map(str::to_owned));
    let body = MeasurementCreated {
        scan_id: record.scan_id.clone(),
        tool: text(&result["tool"]).unwrap_or_default(),
        name: text(&result["name"]),
        value: result["value"].as_f64(),
        unit: text(&result["unit"]).unwrap_or_default(),
        expanded_uncertainty: result["expanded_uncertainty"].as_f64(),
        verdict: text(&result["verdict"]),
        actor: actor.map(str::to_owned),
    };
    vec![Change::InsertMeasurement(record.clone()), event(&record.id, Event::MeasurementCreated(body))]
}

fn request_json(input: &MeasureInput, request: &MeasureRequest) -> Value {
    let region_mm = match request.region {
        Some(Region::Box { min_mm, max_mm }) => json!({ "min": min_mm, "max": max_mm }),
        _ => Value::Null,
    };
    json!({
        "tool": request.tool.name(),
        "name": input.name,
        "nominal_mm": request.nominal_mm,
        "tolerance_mm": request.tolerance_mm,
        "seed": request.seed,
        "region_mm": region_mm,
    })
}
