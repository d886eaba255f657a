//! Wire types: requests and responses. Their doc comments are the API documentation.

pub mod calibration;
pub mod doors;
pub mod events;
pub mod hardware;
pub mod inspection;
pub mod job;
pub mod measurement;
pub mod paging;
pub mod recipe;
pub mod scan;
pub mod service;
pub mod statistics;
pub mod study;

use serde::de::DeserializeOwned;
use serde_json::Value;
use store::DamagedRow;

use crate::typed_json::typed;

/// Parses the JSON of a stored record. JSON that this version cannot read counts as a damaged record; it is not guessed.
fn parse_stored<T: DeserializeOwned>(kind: &'static str, id: &str, stored: Value) -> Result<T, DamagedRow> {
    typed(stored).map_err(|cause| {
        tracing::warn!(kind, id, %cause, "the stored JSON of a record cannot be read");
        DamagedRow { kind, id: id.to_owned() }
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde::Serialize;
    use serde_json::json;

    use super::*;
    use crate::wire::calibration::calibration_summaries::CalibrationSummaryDto;
    use crate::wire::measurement::measurement_results::{MeasurementRequestDto, MeasurementResultDto};
    use crate::wire::scan::captures::CaptureSummaryDto;
    use crate::wire::scan::scan_reports::ScanReportDto;

    /// Asserts that the JSON of a stored record is returned in full.
    fn assert_round_trip<T: DeserializeOwned + Serialize>(stored: Value) {
        let parsed: T = parse_stored("record", "7", stored.clone()).unwrap();
        assert_eq!(serde_json::to_value(parsed).unwrap(), stored);
    }

    fn errors() -> Value {
        json!({ "n_points": 9, "mean_mm": 0.001, "rmse_mm": 0.02, "max_mm": 0.05 })
    }

    #[test]
    fn a_measurement_is_returned_in_full() {
        assert_round_trip::<MeasurementRequestDto>(json!({
            "tool": "sphere", "name": null, "nominal_mm": 18.9, "tolerance_mm": null, "seed": 1,
            "region_mm": { "min": [0.0, 1.0, 2.0], "max": [3.0, 4.0, 5.0] },
        }));
        let region = json!({ "origin_mm": [0.0, 0.0, 0.0], "cell_mm": 0.5, "size": [2, 3, 4], "cells": [0, 5],
            "band_mm": 0.1 });
        let shapes = [
            json!({ "kind": "sphere", "centre_mm": [0.0, 1.0, 400.0], "radius_mm": 18.9 }),
            json!({ "kind": "plane", "point_mm": [0.0, 1.0, 400.0], "normal": [0.0, 0.0, -1.0] }),
            json!({ "kind": "cylinder", "point_mm": [0.0, 1.0, 400.0], "axis": [1.0, 0.0, 0.0], "radius_mm": 2.0 }),
        ];
        let features: Vec<Value> = shapes
            .into_iter()
            .map(|shape| {
                json!({ "role": "face", "shape": shape, "n_points": 9, "n_outliers": 1, "n_border": 2,
                    "rms_mm": 0.02, "region": region })
            })
            .collect();
        assert_round_trip::<MeasurementResultDto>(json!({
            "tool": "sphere", "name": "ball", "unit": "mm", "value": 18.9, "nominal": 18.9, "error": 0.0,
            "u_noise": 0.001, "u_systematic": 0.002, "expanded_uncertainty": 0.004, "coverage_factor": 2.0,
            "uncertainty_complete": true, "uncertainty_missing": ["wavelength"],
            "findings": [{ "kind": "short_arc", "text": "the arc is short" }], "tilts_deg": [0.1, 0.2],
            "tolerance": 0.1, "verdict": "not_ok", "errors": errors(),
            "per_order": [{ "order": -1, "errors": errors(), "value_mm": 18.9, "centre_mm": [0.0, 1.0, 400.0] }],
            "features": features, "notes": ["a note"], "calibration_id": "c", "scan_state": "complete",
        }));
    }

    #[test]
    fn an_unmeasurable_characteristic_is_returned_as_such() {
        let stored = json!({
            "tool": "angle", "unit": "°", "value": null, "nominal": 90.0, "error": null, "u_noise": null,
            "u_systematic": null, "expanded_uncertainty": null, "coverage_factor": 2, "tolerance": 0.1,
            "verdict": "invalid", "errors": null, "per_order": [], "features": [],
            "notes": ["not measurable: no plane"], "calibration_id": "c", "scan_state": "invalid",
        });
        let parsed: MeasurementResultDto = parse_stored("measurement", "7", stored).unwrap();
        assert_eq!((parsed.value, parsed.uncertainty_complete, parsed.notes.len()), (None, None, 1));
    }

    #[test]
    fn a_scan_is_returned_in_full_and_a_stopped_one_with_what_it_has() {
        let delays = json!({ "p50": 1.0, "p99": 2.0, "max": 3.0 });
        assert_round_trip::<ScanReportDto>(json!({
            "scan": "gauge", "n_frames": 9, "n_points": 90, "n_segments": 5, "median_sigma_mm": 0.01,
            "left_out": [{ "reason": "no hit", "n_points": 2, "n_pieces": 1 }],
            "self_consistency": [{ "order_a": -1, "order_b": 0, "n_pairs": 4, "bias_mm": 0.1, "rms_mm": 0.2 }],
            "envelope": { "stated_mm": [350.0, 450.0], "unambiguous_mm": [360.0, 440.0] }, "losses": ["one"],
            "timing": { "n_frames": 9, "frames_read": 27, "evaluation_s": 1.5, "acquisition_s": 2.0,
                "n_rows": 9, "waiting_s": 0.5, "frames_per_s": 30.0, "arrival_to_profile_ms": delays,
                "arrival_to_file_ms": delays, "measuring_s": 0.3, "n_measured": 1 },
        }));
        let stopped = json!({ "scan": "part", "n_frames": 3, "losses": [], "stopped": "stopped by a person" });
        let parsed: ScanReportDto = parse_stored("scan", "7", stopped).unwrap();
        assert_eq!((parsed.n_frames, parsed.n_points, parsed.stopped.is_some()), (3, None, true));
    }

    #[test]
    fn a_capture_and_a_calibration_are_returned_in_full() {
        assert_round_trip::<CaptureSummaryDto>(json!({
            "width_px": 1280, "height_px": 1024, "n_poses": 12, "n_laser_poses": 11, "n_stage_views": 5,
            "scans": [{ "name": "gauge", "n_frames": 40, "from_mm": -1.0, "to_mm": 1.0 }],
            "unpacked_bytes": 5_000_000_000_u64, "warnings": ["a warning"],
        }));
        assert_round_trip::<CalibrationSummaryDto>(json!({
            "corner_rms_px": 0.03, "corner_sigma_px": 0.02, "k3_reason": "not needed",
            "camera": { "fx": { "value": 2000.0, "sigma": 0.5 } },
            "images": [{ "image": "a.png", "rms_px": 0.03, "n_corners": 88 }], "model": "grating",
            "light_rms_px": 0.05, "systematic_sigma_mm": 0.004,
            "models": { "scores": [{ "model": "planes", "held_out_rms_px": 0.5, "held_out_rms_mm": 0.4,
                "held_out_bias_mm": null, "fit_rms_px": 0.3, "failure": "no" }], "recommended": "grating",
                "reason": "it fits best" },
            "n_poses": 12, "n_laser_poses": 11, "n_stage_views": 5, "depth_near_mm": 350.0, "depth_far_mm": 450.0,
            "stage": { "direction": [1.0, 0.0, 0.0], "sigma": [0.1, 0.1, 0.1], "scale_error": 0.001,
                "scale_sigma": 0.0001, "straightness_rms_um": 2.0, "straightness_sigma_um": 1.5,
                "straightness_um": [[-5.0, 0.1, 0.2, 0.3]],
                "tilt_sigma_urad": [90.0, 40.0, 20.0], "tilt_urad": [[-5.0, 30.0, -20.0, 10.0]] },
            "correction": { "n_images": 29, "n_corrected": 28, "dark_frames": [{ "used": "full", "taken_at_ms": 7,
                "exposure_us": 20000.0, "n_hot_pixels": 12 }] },
            "warnings": [], "left_out": ["b.png"],
        }));
    }

    #[test]
    fn figures_of_another_version_name_their_record() {
        let row = parse_stored::<CaptureSummaryDto>("capture", "7", json!({ "width_px": "many" })).unwrap_err();
        assert_eq!((row.kind, row.id.as_str()), ("capture", "7"));
    }
}
