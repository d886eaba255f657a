//! Results as tables for a person and as JSON for a machine.

mod calibration;

pub use calibration::{calibration_json, calibration_text, order_sums};
