//! Plans a scan on the station before anything moves: rows, duration, point density, σ, depth range, disk space.

mod checks;
mod motion;
mod pace;
mod params;
mod prediction;
mod requested;

use optics::Calibration;
use station::StationStatus;

pub use crate::resources::scan_run::{ScanPlan, ScanRun};
pub use pace::{Pace, TIMING};
pub use requested::{RequestedRange, fields_of};

use crate::error::AppError;
use crate::jobs::{ScanInput, ScanMode};
use crate::resources::scan_run::ScanRange;

/// Plans a scan; `pace`: measured durations on this machine.
///
/// # Errors
/// A problem with the JSON pointer of the field and a remedy: a missing value, outside the travel, too fast, too many
/// points.
pub fn plan(
    input: &ScanInput,
    calibration: &Calibration,
    status: &StationStatus,
    pace: &Pace,
) -> Result<ScanPlan, AppError> {
    checks::numbers(input)?;
    checks::devices(status)?;
    checks::camera(calibration, status)?;
    let rows = checks::rows(input, status)?;
    checks::travel(&rows, calibration, status)?;
    let exposures_us = checks::exposures_us(input, &rows, status)?;
    let exposure_us = match exposures_us.last() {
        Some(longest_us) => *longest_us,
        None => checks::exposure_us(input, &rows, status)?,
    };
    let laser_power = checks::laser_power(input, status)?;
    checks::background(input, &rows, status)?;
    let range = rows.range;
    let n_rows = (range.length() / range.step + 1e-6).floor() as usize + 1;
    let prediction = prediction::predict(calibration, range.step);
    let max_points = checks::points(n_rows, &rows, calibration)?;
    let exposed_us = if exposures_us.is_empty() { exposure_us } else { exposures_us.iter().sum() };
    let motion_s = motion::duration_s(&rows, n_rows, exposed_us, status);
    // The overhead of a row occurs for every exposure.
    let n_exposures = exposures_us.len().max(1);
    let acquisition_s = motion_s + (n_rows * n_exposures) as f64 * pace.row_overhead_s;
    let evaluation_s = n_rows as f64 * pace.evaluation_s_per_frame;
    let measuring_s = input.measure.len() as f64 * pace.measuring_s;
    let disk_bytes = prediction::disk_bytes(max_points, n_kept(input, n_rows), status);
    Ok(ScanPlan {
        mode: rows.mode,
        range,
        n_rows,
        frame_rate_hz: rows.frame_rate_hz,
        exposure_us,
        exposures_us,
        laser_power,
        keep_frames: input.settings.keep_frames,
        background: input.settings.background,
        duration_s: acquisition_s + evaluation_s + measuring_s,
        acquisition_s,
        evaluation_s,
        measuring_s,
        n_orders: calibration.orders.len(),
        rows_per_mm: prediction.rows_per_mm,
        points_per_mm_along_line: prediction.points_per_mm_along_line,
        points_per_mm2: prediction.rows_per_mm * prediction.points_per_mm_along_line,
        max_points,
        predicted_sigma_mm: prediction.sigma_mm,
        depth_mm: prediction.depth_mm,
        unambiguous_depth_mm: prediction.unambiguous_depth_mm,
        disk_bytes,
        notes: checks::notes(&rows, exposure_us, status, &prediction),
    })
}

/// Number of images kept: one frame per row, and at most as many laser-off images.
fn n_kept(input: &ScanInput, n_rows: usize) -> usize {
    match (input.settings.keep_frames, input.settings.background) {
        (false, _) => 0,
        (true, None) => n_rows,
        (true, Some(_)) => 2 * n_rows,
    }
}

/// The rows of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rows {
    mode: ScanMode,
    range: ScanRange,
    /// Frame rate of a continuous scan, in addition to the speed in the range.
    frame_rate_hz: Option<f64>,
}

#[cfg(test)]
mod tests;
