//! Width of a frame's lines in focus, and the largest step of a line from one scan column (row) to the next.

use vision::{CentrelinePoint, Centrelines, LineDirection};

use crate::params::{KINK_STEP_WIDTHS, WIDTH_STRIDE_POINTS};

/// Quantile of the widths taken as the width in focus: lines out of focus do not show the resolution of the image.
const IN_FOCUS_QUANTILE: f64 = 0.25;
/// Smallest component of a line's unit normal across the scan columns (rows): the extraction follows lines up to a
/// slope of 75°.
const MIN_NORMAL_ACROSS: f64 = 0.25;

/// Full width at half height of the lines of a frame that are in focus, px; the lower quartile of all widths. 0 without
/// lines.
pub fn in_focus_width_px(lines: &Centrelines) -> f64 {
    let points = lines.segments.iter().flat_map(|segment| segment.points.iter().step_by(WIDTH_STRIDE_POINTS));
    let mut widths: Vec<f32> = points.map(|point| point.width_px).collect();
    if widths.is_empty() {
        return 0.0;
    }
    let place = (IN_FOCUS_QUANTILE * widths.len() as f64) as usize;
    f64::from(*widths.select_nth_unstable_by(place, f32::total_cmp).1)
}

/// Largest step to the next scan column (row) within one line, px: half the extent of the line in its column
/// (row), which increases with its slope. `width_px`: full width of lines at half their height.
pub fn largest_step_px(point: &CentrelinePoint, width_px: f64, direction: LineDirection) -> f64 {
    largest_level_step_px(width_px) / point.normal_across(direction).abs().max(MIN_NORMAL_ACROSS)
}

/// [`largest_step_px`] of a line without slope, px; that of a sloping line is larger.
pub fn largest_level_step_px(width_px: f64) -> f64 {
    KINK_STEP_WIDTHS * width_px
}
