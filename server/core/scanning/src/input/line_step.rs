//! How wide a frame's lines are, and how far one may step from one scan column (row) to the next.

use vision::{CentrelinePoint, Centrelines, LineDirection};

use crate::params::{KINK_STEP_WIDTHS, WIDTH_STRIDE_POINTS};

/// Share of the points whose lines are narrower: lines out of focus say nothing of how fine the picture is.
const SHARP_SHARE: f64 = 0.25;
/// Smallest share of a line's normal across the scan columns (rows): the extraction follows lines up to 75° of slope.
const LEAST_ACROSS: f64 = 0.25;

/// Full width at half height of the lines of a frame that are in focus, px; the lower quartile of all widths. 0 without lines.
pub fn sharp_width_px(lines: &Centrelines) -> f64 {
    let points = lines.segments.iter().flat_map(|segment| segment.points.iter().step_by(WIDTH_STRIDE_POINTS));
    let mut widths: Vec<f32> = points.map(|point| point.width_px).collect();
    if widths.is_empty() {
        return 0.0;
    }
    let place = (SHARP_SHARE * widths.len() as f64) as usize;
    f64::from(*widths.select_nth_unstable_by(place, f32::total_cmp).1)
}

/// Largest step to the next scan column (row) that stays one line, px: half of what the line covers in its column (row),
/// which grows with its slope. `width_px`: full width of lines at half their height.
pub fn largest_step_px(point: &CentrelinePoint, width_px: f64, direction: LineDirection) -> f64 {
    let across = match direction {
        LineDirection::Rows => point.normal[1],
        LineDirection::Columns => point.normal[0],
    };
    KINK_STEP_WIDTHS * width_px / across.abs().max(LEAST_ACROSS)
}
