//! What a scan from the station will be, before anything moves: rows, duration, density, σ, depths, disk.

mod checks;
mod motion;
mod pace;
mod params;
mod prediction;

use optics::Calibration;
use serde::{Deserialize, Serialize};
use station::StationStatus;
use utoipa::ToSchema;

pub use pace::{Pace, TIMING};

use crate::error::AppError;
use crate::jobs::{ScanInput, ScanMode};

/// A scan as it will be run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ScanPlan {
    /// How the stage moves.
    pub mode: ScanMode,
    /// Position of the first row, mm.
    pub from_mm: f64,
    /// No row lies beyond this position, mm.
    pub to_mm: f64,
    /// Distance between rows, mm, positive in both directions.
    pub step_mm: f64,
    /// Number of rows, each one frame.
    pub n_rows: usize,
    /// Speed during a continuous scan, mm/s.
    pub speed_mm_s: Option<f64>,
    /// Frames per second of a continuous scan.
    pub frame_rate_hz: Option<f64>,
    /// Exposure of the laser frames, µs.
    pub exposure_us: f64,
    /// Share of full laser power, 0–1.
    pub laser_power: f64,
    /// Whether the pictures are kept as a capture.
    pub keep_frames: bool,
    /// How long the whole job will take, s: frames, cloud and measurements, by the pace of this machine's last scans.
    pub duration_s: f64,
    /// How long the frames take, from the first motion to the last row, s.
    #[serde(default)]
    pub acquisition_s: f64,
    /// How long the cloud takes after the last row, s.
    #[serde(default)]
    pub evaluation_s: f64,
    /// How long the measurements take after that, s.
    #[serde(default)]
    pub measuring_s: f64,
    /// Lines: every order sweeps the part on its own.
    pub n_orders: usize,
    /// Rows per mm of a flat part across the camera, for each order.
    pub rows_per_mm: f64,
    /// Points per mm along a line.
    pub points_per_mm_along_line: f64,
    /// Points per mm² of a flat part across the camera, for each order that sees it.
    pub points_per_mm2: f64,
    /// Most points the cloud can have.
    pub max_points: u64,
    /// Standard deviation of a point along its camera ray, mm: image noise on matt grey paint and the calibration;
    /// nothing if the calibrated depths are out of view.
    pub predicted_sigma_mm: Option<f64>,
    /// Depths (z of the camera) in which the part may lie, mm: nearest and farthest.
    pub depth_mm: [f64; 2],
    /// Depths in which a line's place in the image alone tells its order, mm; beyond, a second look is needed.
    pub unambiguous_depth_mm: [f64; 2],
    /// Room on the disk that it needs, bytes.
    pub disk_bytes: u64,
    /// What a person should know before it begins.
    pub notes: Vec<String>,
}

impl ScanPlan {
    /// Stage position of a row, mm, to the nanometre: records show what was meant.
    pub fn position_mm(&self, row: usize) -> f64 {
        let at = self.from_mm + self.direction() * self.step_mm * row as f64;
        (at * 1e6).round() / 1e6
    }

    /// +1 or −1.
    pub fn direction(&self) -> f64 {
        if self.to_mm < self.from_mm { -1.0 } else { 1.0 }
    }

    /// Whether frames taken by `other` and by this one belong to one scan.
    pub fn continues(&self, other: &Self) -> bool {
        /// Step and rate follow from each other by a division: they agree to the last digits.
        const ROUNDING: f64 = 1e-9;
        let near = |a: f64, b: f64| (a - b).abs() <= ROUNDING * b.abs();
        let same = |plan: &Self| {
            (plan.mode, plan.from_mm, plan.to_mm, plan.speed_mm_s, plan.exposure_us, plan.laser_power)
        };
        same(self) == same(other) && self.keep_frames == other.keep_frames && near(self.step_mm, other.step_mm)
    }
}

/// How the stage will move, as far as the input says; a refusal of the rest comes with the plan.
pub fn mode_of(input: &ScanInput) -> ScanMode {
    let by_speed = if input.speed_mm_s.is_some() { ScanMode::Continuous } else { ScanMode::StopAndGo };
    input.mode.unwrap_or(by_speed)
}

/// Plans a scan; `pace`: of this machine.
///
/// # Errors
/// A problem with the place in the input and a remedy: what is missing, outside the travel, too fast, too much.
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
    let exposure_us = checks::exposure_us(input, &rows, status)?;
    let laser_power = checks::laser_power(input, status)?;
    let n_rows = ((rows.to_mm - rows.from_mm).abs() / rows.step_mm + 1e-6).floor() as usize + 1;
    let prediction = prediction::predict(calibration, rows.step_mm);
    let max_points = checks::points(n_rows, calibration)?;
    let motion_s = motion::duration_s(&rows, n_rows, exposure_us, status);
    let acquisition_s = motion_s + n_rows as f64 * pace.row_overhead_s;
    let evaluation_s = n_rows as f64 * pace.evaluation_s_per_frame;
    let measuring_s = input.measure.len() as f64 * pace.measuring_s;
    let disk_bytes = prediction::disk_bytes(max_points, n_rows, input.keep_frames, status);
    Ok(ScanPlan {
        mode: rows.mode,
        from_mm: rows.from_mm,
        to_mm: rows.to_mm,
        step_mm: rows.step_mm,
        n_rows,
        speed_mm_s: rows.sweep.map(|sweep| sweep.speed_mm_s),
        frame_rate_hz: rows.sweep.map(|sweep| sweep.frame_rate_hz),
        exposure_us,
        laser_power,
        keep_frames: input.keep_frames,
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

/// The rows of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rows {
    mode: ScanMode,
    from_mm: f64,
    to_mm: f64,
    step_mm: f64,
    sweep: Option<SweepRate>,
}

/// How a continuous scan runs.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SweepRate {
    speed_mm_s: f64,
    frame_rate_hz: f64,
}

#[cfg(test)]
mod tests;
