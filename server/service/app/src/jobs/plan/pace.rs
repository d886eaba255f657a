//! Measured durations on this machine, from its recent scans.

use statistics::median;
use store::{Page, ScanFilter, ScanRecord, ScanState};

use super::params::{EVALUATION_S_PER_FRAME, MEASURING_S, PACE_SCANS, PASSES, ROW_OVERHEAD_S};
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::ScanMode;
use crate::jobs::plan::ScanRun;

/// Key of the durations in a scan report.
pub const TIMING: &str = "timing";

/// Durations that a plan cannot derive from device capabilities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Overhead per row in addition to motion and exposure, s: trigger, read-out, transfer, settling, scheduling.
    pub row_overhead_s: f64,
    /// From centrelines to a stored cloud, s per frame.
    pub evaluation_s_per_frame: f64,
    /// One measurement, s.
    pub measuring_s: f64,
    /// Number of times that the evaluation reads each frame.
    pub passes: f64,
}

impl Pace {
    /// Defaults for a machine that has not scanned yet.
    pub fn unknown(mode: ScanMode) -> Self {
        let row_overhead_s = match mode {
            ScanMode::StopAndGo => ROW_OVERHEAD_S,
            // The frame rate is fixed.
            ScanMode::Continuous => 0.0,
        };
        Self {
            row_overhead_s,
            evaluation_s_per_frame: EVALUATION_S_PER_FRAME,
            measuring_s: MEASURING_S,
            passes: PASSES,
        }
    }

    /// From the newest scans of this kind; defaults for what none of them recorded.
    pub async fn learned(catalogue: &EventedCatalogue, mode: ScanMode) -> Self {
        let filter = ScanFilter { state: Some(ScanState::Complete), ..ScanFilter::default() };
        let page = Page { before: None, limit: PACE_SCANS };
        match catalogue.read().scans(&filter, &page).await {
            Ok(listed) => Self::of(&listed.records, mode),
            Err(_) => Self::unknown(mode),
        }
    }

    fn of(newest: &[ScanRecord], mode: ScanMode) -> Self {
        let unknown = Self::unknown(mode);
        let recorded = |key: &str, per: &str, of_mode: bool| {
            let same = |scan: &&ScanRecord| !of_mode || mode_of(scan) == Some(mode);
            let values = newest.iter().filter(same).filter_map(|scan| {
                let timing = &scan.report[TIMING];
                Some(timing[key].as_f64()? / timing[per].as_f64().filter(|n| *n > 0.0)?)
            });
            median(&mut values.filter(|value| value.is_finite()).collect::<Vec<f64>>())
        };
        Self {
            row_overhead_s: recorded("waiting_s", "n_rows", true).map_or(unknown.row_overhead_s, |s| s.max(0.0)),
            evaluation_s_per_frame: recorded("evaluation_s", "n_frames", false)
                .unwrap_or(unknown.evaluation_s_per_frame),
            measuring_s: recorded("measuring_s", "n_measured", false).unwrap_or(unknown.measuring_s),
            passes: recorded("frames_read", "n_frames", false).unwrap_or(unknown.passes),
        }
    }
}

/// Motion mode of a scan; `None` for a scan of a capture, or with several exposures per row.
fn mode_of(scan: &ScanRecord) -> Option<ScanMode> {
    ScanRun::of(scan).ok()?.plan.filter(|plan| plan.exposures_us.is_empty()).map(|plan| plan.mode)
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::resources::scan_run::stored_by_the_station;

    fn scan(mode: &str, timing: Value) -> ScanRecord {
        ScanRecord {
            id: "s".into(),
            name: "s".into(),
            state: ScanState::Complete,
            calibration_id: "c".into(),
            plan: stored_by_the_station(mode),
            peaks: store::ArtifactId::parse(&"0".repeat(64)).unwrap(),
            capture_id: None,
            cloud: None,
            display: None,
            report: json!({ "timing": timing }),
            recomputed_from: None,
            job_id: None,
            software_version: "0".into(),
            created_at_ms: 0,
        }
    }

    #[test]
    fn the_median_of_recent_scans_of_the_same_mode_is_used() {
        let slow = json!({ "waiting_s": 60.0, "n_rows": 200, "evaluation_s": 20.0, "n_frames": 200,
            "measuring_s": 6.0, "n_measured": 2, "frames_read": 600 });
        let odd = json!({ "waiting_s": 900.0, "n_rows": 100 });
        let sweep = json!({ "waiting_s": 1.0, "n_rows": 100, "evaluation_s": 10.0, "n_frames": 100 });
        let scans = [
            scan("stop_and_go", slow.clone()),
            scan("stop_and_go", odd),
            scan("stop_and_go", slow),
            scan("continuous", sweep),
        ];
        let pace = Pace::of(&scans, ScanMode::StopAndGo);
        let expected = Pace { row_overhead_s: 0.3, evaluation_s_per_frame: 0.1, measuring_s: 3.0, passes: 3.0 };
        assert_eq!(pace, expected);
        assert_eq!(Pace::of(&scans, ScanMode::Continuous).row_overhead_s, 0.01);
    }

    #[test]
    fn without_scans_defaults_are_used() {
        assert_eq!(Pace::of(&[], ScanMode::StopAndGo), Pace::unknown(ScanMode::StopAndGo));
    }
}
