//! What a scan from the station will be.

use crate::resources::scan_run::{BackgroundInput, ScanMode, ScanRange};

/// A scan as it will be run.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanPlan {
    /// How the stage moves.
    pub mode: ScanMode,
    /// Its rows along the way of the stage.
    pub range: ScanRange,
    /// Number of rows, each one frame.
    pub n_rows: usize,
    /// Frames per second of a continuous scan.
    pub frame_rate_hz: Option<f64>,
    /// Exposure of the laser frames, µs; of several the longest.
    pub exposure_us: f64,
    /// All exposures of a row, µs, the shortest first; empty where a row has one.
    pub exposures_us: Vec<f64>,
    /// Share of full laser power, 0–1.
    pub laser_power: f64,
    /// Whether the pictures are kept as a capture.
    pub keep_frames: bool,
    /// When pictures with the laser off are taken.
    pub background: Option<BackgroundInput>,
    /// How long the whole job will take, s: frames, cloud and measurements, by the pace of this machine's last scans.
    pub duration_s: f64,
    /// How long the frames take, from the first motion to the last row, s.
    pub acquisition_s: f64,
    /// How long the cloud takes after the last row, s.
    pub evaluation_s: f64,
    /// How long the measurements take after that, s.
    pub measuring_s: f64,
    /// Lines: every order sweeps the part on its own.
    pub n_orders: usize,
    /// Rows per mm of a flat part across the camera, for each order; on a turntable, of a surface half-way between its axis
    /// and the nearest calibrated depth.
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
    /// Depths in which a line's image position alone determines its order, mm; beyond, a second look is needed.
    pub unambiguous_depth_mm: [f64; 2],
    /// Room on the disk that it needs, bytes.
    pub disk_bytes: u64,
    /// What a person should know before it begins.
    pub notes: Vec<String>,
}

impl ScanPlan {
    /// Whether frames taken by `other` and by this one belong to one scan.
    pub fn continues(&self, other: &Self) -> bool {
        /// Step and rate follow from each other by a division: they agree to the last digits.
        const ROUNDING: f64 = 1e-9;
        let near = |a: f64, b: f64| (a - b).abs() <= ROUNDING * b.abs();
        let same =
            |plan: &Self| (plan.mode, plan.exposure_us, plan.laser_power, plan.keep_frames, plan.background);
        let (range, of_other) = (self.range, other.range);
        same(self) == same(other)
            && self.exposures_us == other.exposures_us
            && ScanRange { step: of_other.step, ..range } == of_other
            && near(range.step, of_other.step)
    }
}
