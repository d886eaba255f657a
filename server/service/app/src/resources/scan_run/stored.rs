//! How a scan was made, as stored in its record.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use store::ScanRecord;

use crate::error::{AppError, ErrorKind};
use crate::resources::scan_run::{
    BackgroundInput, MeasureInput, ScanMode, ScanPlan, ScanPurpose, ScanRange, ScanSource,
};

/// How a scan was made.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanRun {
    /// Source of its frames.
    pub source: ScanSource,
    /// Name of the scan in the header of its cloud.
    pub cloud_name: String,
    /// Number of planned rows.
    pub n_rows: usize,
    /// What is measured on it in the same job.
    pub measure: Vec<MeasureInput>,
    /// Its purpose.
    pub purpose: ScanPurpose,
    /// The plan on the station; `None` for a capture.
    pub plan: Option<ScanPlan>,
}

impl ScanRun {
    /// Reads it from a stored scan.
    ///
    /// # Errors
    /// A problem if it was stored by an incompatible version.
    pub fn of(scan: &ScanRecord) -> Result<Self, AppError> {
        Self::from_stored(&scan.plan).map_err(|cause| {
            AppError::new(ErrorKind::Damaged, format!("how scan {} was made cannot be read", scan.id))
                .because(cause.to_string())
                .remedy("scan the part again")
        })
    }

    /// From the stored form.
    ///
    /// # Errors
    /// If it has another form.
    pub fn from_stored(stored: &Value) -> Result<Self, serde_json::Error> {
        Ok(StoredRun::deserialize(stored)?.into())
    }

    /// The stored form.
    pub fn to_stored(&self) -> Value {
        serde_json::to_value(StoredRun::from(self.clone())).expect("a run is numbers and texts with text keys")
    }
}

/// The stored form: one object; fields that only a station provides are absent for a capture.
#[derive(Debug, Serialize, Deserialize)]
struct StoredRun {
    source: ScanSource,
    scan: String,
    n_rows: usize,
    #[serde(default)]
    measure: Vec<MeasureInput>,
    #[serde(default)]
    purpose: ScanPurpose,
    #[serde(flatten)]
    plan: Option<Plan>,
}

/// A plan by its stored form.
#[derive(Debug, Serialize, Deserialize)]
struct Plan(#[serde(with = "StoredPlan")] ScanPlan);

/// A plan without its rows, which are in [`StoredRun`]; `remote` makes the compiler check it against [`ScanPlan`].
#[derive(Serialize, Deserialize)]
#[serde(remote = "ScanPlan")]
struct StoredPlan {
    mode: ScanMode,
    #[serde(flatten)]
    range: ScanRange,
    #[serde(skip)]
    n_rows: usize,
    frame_rate_hz: Option<f64>,
    exposure_us: f64,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    exposures_us: Vec<f64>,
    laser_power: f64,
    keep_frames: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    background: Option<BackgroundInput>,
    duration_s: f64,
    #[serde(default)]
    acquisition_s: f64,
    #[serde(default)]
    evaluation_s: f64,
    #[serde(default)]
    measuring_s: f64,
    n_orders: usize,
    rows_per_mm: f64,
    points_per_mm_along_line: f64,
    points_per_mm2: f64,
    max_points: u64,
    predicted_sigma_mm: Option<f64>,
    depth_mm: [f64; 2],
    unambiguous_depth_mm: [f64; 2],
    disk_bytes: u64,
    notes: Vec<String>,
}

impl From<StoredRun> for ScanRun {
    fn from(stored: StoredRun) -> Self {
        let StoredRun { source, scan, n_rows, measure, purpose, plan } = stored;
        let plan = plan.map(|Plan(plan)| ScanPlan { n_rows, ..plan });
        Self { source, cloud_name: scan, n_rows, measure, purpose, plan }
    }
}

impl From<ScanRun> for StoredRun {
    fn from(run: ScanRun) -> Self {
        let ScanRun { source, cloud_name, n_rows, measure, purpose, plan } = run;
        Self { source, scan: cloud_name, n_rows, measure, purpose, plan: plan.map(Plan) }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
pub(crate) mod tests {
    use serde_json::json;

    use super::*;

    /// A station scan as stored by version 0.1.
    pub(crate) fn stored_by_the_station(mode: &str) -> Value {
        json!({
            "mode": mode, "from_mm": -1.0, "to_mm": 1.0, "step_mm": 0.5, "n_rows": 5, "speed_mm_s": null,
            "frame_rate_hz": null, "exposure_us": 800.0, "laser_power": 1.0, "keep_frames": false,
            "duration_s": 3.5, "acquisition_s": 2.0, "evaluation_s": 1.0, "measuring_s": 0.5, "n_orders": 5,
            "rows_per_mm": 2.0, "points_per_mm_along_line": 4.0, "points_per_mm2": 8.0, "max_points": 5120,
            "predicted_sigma_mm": 0.02, "depth_mm": [350.0, 450.0], "unambiguous_depth_mm": [360.0, 440.0],
            "disk_bytes": 800_000, "notes": ["a note"], "source": { "kind": "station" }, "scan": "part",
            "measure": [{ "tool": "sphere", "name": null, "nominal_mm": 18.9, "tolerance_mm": 0.1,
                "region_mm": null, "seed": null }],
            "purpose": "production",
        })
    }

    #[test]
    fn the_stored_form_is_read_and_written() {
        let stored = stored_by_the_station("stop_and_go");
        let run = ScanRun::from_stored(&stored).unwrap();
        let plan = run.plan.as_ref().unwrap();
        assert_eq!((run.n_rows, plan.n_rows, plan.max_points), (5, 5, 5120));
        assert_eq!((run.cloud_name.as_str(), run.measure.len()), ("part", 1));
        assert_eq!(run.to_stored(), stored);
        let mut turned = stored_by_the_station("continuous");
        let fields = turned.as_object_mut().unwrap();
        for (linear, rotary) in
            [("from_mm", "from_deg"), ("to_mm", "to_deg"), ("step_mm", "step_deg"), ("speed_mm_s", "speed_deg_s")]
        {
            let value = fields.remove(linear).unwrap();
            fields.insert(rotary.to_owned(), value);
        }
        let run = ScanRun::from_stored(&turned).unwrap();
        assert_eq!(run.plan.as_ref().unwrap().range.stage, optics::StageKind::Rotary);
        assert_eq!(run.to_stored(), turned);
        let of_a_capture = json!({ "source": { "kind": "capture", "capture_id": "c", "scan": "gauge" },
            "scan": "gauge", "n_rows": 40, "measure": [], "purpose": "verification" });
        let run = ScanRun::from_stored(&of_a_capture).unwrap();
        assert_eq!((run.plan.as_ref(), run.purpose), (None, ScanPurpose::Verification));
        assert_eq!(run.to_stored(), of_a_capture);
    }

    #[test]
    fn a_stored_scan_without_a_purpose_counts_as_production() {
        let mut stored = stored_by_the_station("continuous");
        let fields = stored.as_object_mut().unwrap();
        fields.retain(|name, _| !["measure", "purpose", "acquisition_s"].contains(&name.as_str()));
        let run = ScanRun::from_stored(&stored).unwrap();
        assert_eq!((run.purpose, run.measure.len()), (ScanPurpose::Production, 0));
        assert_eq!(run.plan.unwrap().acquisition_s, 0.0);
        assert!(ScanRun::from_stored(&json!({ "mode": "continuous" })).is_err());
    }
}
