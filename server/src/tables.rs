//! Results as tables for a person and as JSON for a machine.

mod calibration;
mod scan;

pub use calibration::{calibration_json, calibration_text, order_sums};
pub use scan::{losses, median_sigma_mm, scan_json, scan_text};
