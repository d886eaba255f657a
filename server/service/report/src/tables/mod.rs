//! Results as text tables and as JSON.

mod calibration;
mod comparison;
mod measurement;
mod plan;
mod scan;

pub use calibration::{calibration_json, calibration_text, order_sums};
pub use comparison::{comparison_json, comparison_text};
pub use measurement::{measurement_json, measurement_text};
pub use plan::{plan_json, plan_text};
pub use scan::{closure_gaps, losses, median_sigma_mm, scan_json, scan_text};

/// An order with its sign: 0, +1, −1.
pub fn order_name(order: i8) -> String {
    match order {
        0 => "0".to_owned(),
        order if order > 0 => format!("+{order}"),
        order => format!("−{}", order.unsigned_abs()),
    }
}
