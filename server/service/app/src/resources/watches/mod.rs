//! History of watch results, and the reference order powers from the first scans after a calibration (ADR 27). Stored on
//! the server, bounded.

mod stored;

pub use scanning::params::watches::REFERENCE_SCANS;

use scanning::{Estimate, OrderPowers, PowerReference, Watch, WatchState, WatchVerdict};
use serde_json::{Value, json};
use station::wall_clock::now_ms;
use store::{Change, ScanRecord, SettingRecord, StoreError};

use crate::evented_catalogue::EventedCatalogue;
use crate::events::{Event, WatchWarned, event};
use stored::StoredHistory;

/// The name of the setting.
const SETTING: &str = "watches.history";

/// Maximum number of scans in the history: a week with one scan every half hour.
pub const READINGS_KEPT: usize = 300;

/// Number of calibrations with stored references: enough to roll back.
const REFERENCES_KEPT: usize = 8;

/// Key of the watch results in a scan report.
pub const WATCHES: &str = "watches";

/// Watch results of one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct WatchReading {
    /// The scan.
    pub scan_id: String,
    /// Name of the scan.
    pub scan_name: String,
    /// Its calibration.
    pub calibration_id: String,
    /// Its time.
    pub at_ms: i64,
    /// The results as in its report.
    pub verdicts: Value,
}

/// The history.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WatchHistory {
    /// Recent scans, oldest first.
    pub readings: Vec<WatchReading>,
    /// Order powers of the first scans after each calibration, newest calibration last.
    references: Vec<(String, Vec<OrderPowers>)>,
}

impl WatchHistory {
    /// The stored history; an unreadable one counts as empty and is logged.
    ///
    /// # Errors
    /// If the catalogue cannot be used.
    pub async fn read(catalogue: &EventedCatalogue) -> Result<Self, StoreError> {
        let Some(setting) = catalogue.read().setting(SETTING).await? else { return Ok(Self::default()) };
        match serde_json::from_value::<StoredHistory>(setting.value) {
            Ok(stored) => Ok(stored.into()),
            Err(error) => {
                tracing::error!(%error, "the watch history is unreadable and starts again");
                Ok(Self::default())
            }
        }
    }

    /// Reference powers of a calibration; `None` until enough scans were made with it.
    pub fn reference(&self, calibration_id: &str) -> Option<PowerReference> {
        PowerReference::of(self.first_powers(calibration_id))
    }

    /// Number of scans used for [`WatchHistory::reference`].
    pub fn n_reference_scans(&self, calibration_id: &str) -> usize {
        self.first_powers(calibration_id).len()
    }

    fn first_powers(&self, calibration_id: &str) -> &[OrderPowers] {
        let of = self.references.iter().find(|(id, _)| id == calibration_id);
        of.map_or(&[], |(_, powers)| powers)
    }

    /// Adds a scan; old ones beyond the limits are dropped.
    pub fn add(&mut self, scan: &ScanRecord, powers: Option<OrderPowers>) {
        self.readings.push(WatchReading {
            scan_id: scan.id.clone(),
            scan_name: scan.name.clone(),
            calibration_id: scan.calibration_id.clone(),
            at_ms: scan.created_at_ms,
            verdicts: scan.report[WATCHES].clone(),
        });
        self.readings.drain(..self.readings.len().saturating_sub(READINGS_KEPT));
        let Some(powers) = powers else { return };
        if !self.references.iter().any(|(id, _)| *id == scan.calibration_id) {
            self.references.push((scan.calibration_id.clone(), Vec::new()));
            self.references.drain(..self.references.len().saturating_sub(REFERENCES_KEPT));
        }
        if let Some((_, first)) = self.references.iter_mut().find(|(id, _)| *id == scan.calibration_id)
            && first.len() < REFERENCE_SCANS
        {
            first.push(powers);
        }
    }

    /// The change that stores it.
    pub fn change(&self) -> Change {
        let value =
            serde_json::to_value(StoredHistory::from(self.clone())).expect("a history is numbers and texts");
        Change::PutSetting(SettingRecord { name: SETTING.to_owned(), value, changed_at_ms: now_ms() })
    }
}

/// Results in the form of a scan report.
pub fn verdicts_json(verdicts: &[WatchVerdict]) -> Value {
    let one = |verdict: &WatchVerdict| {
        json!({
            "watch": watch_name(verdict.watch),
            "state": state_name(verdict.state),
            "value": verdict.estimate.map(|estimate| estimate.value),
            "sigma": verdict.estimate.map(|estimate| estimate.sigma),
            "error_mm": verdict.error_mm,
            "position_mm": verdict.position_mm,
            "line": verdict.line,
            "reason_code": verdict.reason_code.code(),
            "reason": verdict.reason,
        })
    };
    verdicts.iter().map(one).collect()
}

/// Why a scan is invalid, as text.
pub fn why_invalid(scan: &ScanRecord) -> String {
    let watches = scan.report[WATCHES].as_array().into_iter().flatten().filter_map(|verdict| {
        (verdict["state"] == state_name(WatchState::Invalid)).then(|| verdict["reason"].as_str()).flatten()
    });
    let losses = scan.report["losses"].as_array().is_some_and(|losses| !losses.is_empty());
    let reasons: Vec<&str> = losses.then_some("frames were lost").into_iter().chain(watches).collect();
    if reasons.is_empty() { "frames were lost".to_owned() } else { reasons.join("; ") }
}

/// One event per warning watch.
pub fn warnings(scan_id: &str, verdicts: &[WatchVerdict]) -> Vec<Change> {
    let clear = |verdict: &&WatchVerdict| matches!(verdict.state, WatchState::Warning | WatchState::Invalid);
    verdicts.iter().filter(clear).map(|verdict| warning(scan_id, verdict)).collect()
}

/// The event of a warning watch.
pub fn warning(scan_id: &str, verdict: &WatchVerdict) -> Change {
    let body = WatchWarned {
        watch: watch_name(verdict.watch).to_owned(),
        state: state_name(verdict.state).to_owned(),
        value: verdict.estimate.map(|Estimate { value, .. }| value),
        sigma: verdict.estimate.map(|Estimate { sigma, .. }| sigma),
        position_mm: verdict.position_mm,
        reason_code: Some(verdict.reason_code.code().to_owned()),
        reason: verdict.reason.clone(),
    };
    event(scan_id, Event::WatchWarned(body))
}

fn watch_name(watch: Watch) -> &'static str {
    match watch {
        Watch::LostSteps => "lost_steps",
        Watch::Wavelength => "wavelength",
        Watch::OrderPowers => "order_powers",
        Watch::StageScale => "stage_scale",
    }
}

fn state_name(state: WatchState) -> &'static str {
    match state {
        WatchState::Quiet => "quiet",
        WatchState::Blind => "blind",
        WatchState::Warning => "warning",
        WatchState::Invalid => "invalid",
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use store::{ArtifactId, ScanState};

    use super::*;

    fn scan(number: usize, calibration_id: &str) -> ScanRecord {
        ScanRecord {
            id: format!("scan-{number}"),
            name: "part".into(),
            state: ScanState::Complete,
            calibration_id: calibration_id.into(),
            plan: Value::Null,
            peaks: ArtifactId::parse(&"0".repeat(64)).unwrap(),
            capture_id: None,
            cloud: None,
            display: None,
            report: json!({ "watches": [{ "watch": "wavelength", "state": "quiet", "reason": "" }] }),
            recomputed_from: None,
            job_id: None,
            software_version: "0".into(),
            created_at_ms: number as i64,
        }
    }

    fn powers(ratio: f64) -> OrderPowers {
        let log_ratios = vec![(1, Estimate { value: ratio, sigma: 0.01 })];
        OrderPowers { reference_order: 0, log_ratios, log_total: 5.0, n_places: 900 }
    }

    #[test]
    fn the_history_is_bounded_and_the_first_scans_of_a_calibration_remain_its_reference() {
        let mut history = WatchHistory::default();
        for number in 0..READINGS_KEPT + 20 {
            let ratio = if number < REFERENCE_SCANS { -0.1 } else { -0.5 };
            history.add(&scan(number, "first"), Some(powers(ratio)));
            assert_eq!(history.reference("first").is_some(), number + 1 >= REFERENCE_SCANS, "{number}");
        }
        assert_eq!((history.readings.len(), history.readings[0].at_ms), (READINGS_KEPT, 20));
        assert_eq!(history.reference("first").unwrap().log_ratios[0].1.value, -0.1);
        for number in 0..REFERENCES_KEPT {
            history.add(&scan(number, &format!("later {number}")), Some(powers(0.0)));
        }
        assert_eq!(history.n_reference_scans("first"), 0);
        assert_eq!(history.n_reference_scans("later 0"), 1);
    }

    #[test]
    fn a_history_survives_a_storage_round_trip() {
        let mut history = WatchHistory::default();
        history.add(&scan(3, "one"), Some(powers(-0.2)));
        let Change::PutSetting(setting) = history.change() else { panic!("a setting is put") };
        let read: WatchHistory = serde_json::from_value::<StoredHistory>(setting.value).unwrap().into();
        assert_eq!(read, history);
    }
}
