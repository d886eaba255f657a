//! How far a line may step from one scan column (row) to the next.

use vision::{CentrelinePoint, LineDirection};

use crate::params::KINK_STEP_WIDTHS;

/// Smallest share of a line's normal across the scan columns (rows): the extraction follows lines up to 75° of slope.
const LEAST_ACROSS: f64 = 0.25;

/// Largest step to the next scan column (row) that stays one line, px: half of what the line covers in its column (row),
/// which grows with its slope.
pub fn largest_step_px(point: &CentrelinePoint, direction: LineDirection) -> f64 {
    let across = match direction {
        LineDirection::Rows => point.normal[1],
        LineDirection::Columns => point.normal[0],
    };
    KINK_STEP_WIDTHS * f64::from(point.width_px) / across.abs().max(LEAST_ACROSS)
}
