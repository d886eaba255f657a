//! Stored form of the watch history.

use scanning::{Estimate, OrderPowers};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{WatchHistory, WatchReading};

/// See [`WatchHistory`].
#[derive(Debug, Serialize, Deserialize)]
pub struct StoredHistory {
    readings: Vec<StoredReading>,
    references: Vec<StoredReference>,
}

#[derive(Debug, Serialize, Deserialize)]
struct StoredReading {
    scan_id: String,
    scan_name: String,
    calibration_id: String,
    at_ms: i64,
    verdicts: Value,
}

#[derive(Debug, Serialize, Deserialize)]
struct StoredReference {
    calibration_id: String,
    powers: Vec<StoredPowers>,
}

#[derive(Debug, Serialize, Deserialize)]
struct StoredPowers {
    against: i8,
    /// Order, value, σ.
    log_ratios: Vec<(i8, f64, f64)>,
    log_total: f64,
    n_places: usize,
}

impl From<WatchHistory> for StoredHistory {
    fn from(history: WatchHistory) -> Self {
        let reading = |WatchReading { scan_id, scan_name, calibration_id, at_ms, verdicts }| StoredReading {
            scan_id,
            scan_name,
            calibration_id,
            at_ms,
            verdicts,
        };
        let powers = |of: OrderPowers| StoredPowers {
            against: of.reference_order,
            log_ratios: of.log_ratios.iter().map(|(order, ratio)| (*order, ratio.value, ratio.sigma)).collect(),
            log_total: of.log_total,
            n_places: of.n_places,
        };
        let reference = |(calibration_id, of): (String, Vec<OrderPowers>)| StoredReference {
            calibration_id,
            powers: of.into_iter().map(powers).collect(),
        };
        Self {
            readings: history.readings.into_iter().map(reading).collect(),
            references: history.references.into_iter().map(reference).collect(),
        }
    }
}

impl From<StoredHistory> for WatchHistory {
    fn from(stored: StoredHistory) -> Self {
        let reading = |StoredReading { scan_id, scan_name, calibration_id, at_ms, verdicts }| WatchReading {
            scan_id,
            scan_name,
            calibration_id,
            at_ms,
            verdicts,
        };
        let powers = |StoredPowers { against, log_ratios, log_total, n_places }| {
            let ratio = |(order, value, sigma)| (order, Estimate { value, sigma });
            OrderPowers {
                reference_order: against,
                log_ratios: log_ratios.into_iter().map(ratio).collect(),
                log_total,
                n_places,
            }
        };
        let reference = |StoredReference { calibration_id, powers: of }| {
            (calibration_id, of.into_iter().map(powers).collect())
        };
        Self {
            readings: stored.readings.into_iter().map(reading).collect(),
            references: stored.references.into_iter().map(reference).collect(),
        }
    }
}
