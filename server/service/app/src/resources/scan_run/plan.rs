//! The plan of a scan on the station.

use crate::resources::scan_run::{BackgroundInput, ScanMode, ScanRange};

/// The plan of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanPlan {
    /// Motion of the stage.
    pub mode: ScanMode,
    /// Its rows along the stage motion.
    pub range: ScanRange,
    /// Number of rows; each row is one frame.
    pub n_rows: usize,
    /// Frame rate of a continuous scan.
    pub frame_rate_hz: Option<f64>,
    /// Exposure time of the laser frames, µs; with several, the longest.
    pub exposure_us: f64,
    /// All exposure times of a row, µs, shortest first; empty if there is only one.
    pub exposures_us: Vec<f64>,
    /// Fraction of full laser power, 0–1.
    pub laser_power: f64,
    /// Whether the images are kept as a capture.
    pub keep_frames: bool,
    /// When laser-off images are captured.
    pub background: Option<BackgroundInput>,
    /// Estimated duration of the whole job, s: frames, cloud and measurements, from recent scans on this machine.
    pub duration_s: f64,
    /// Duration of the acquisition, from the first motion to the last row, s.
    pub acquisition_s: f64,
    /// Duration of the evaluation after the last row, s.
    pub evaluation_s: f64,
    /// Duration of the measurements, s.
    pub measuring_s: f64,
    /// Number of orders; each sweeps the whole part.
    pub n_orders: usize,
    /// Rows per mm on a flat part perpendicular to the camera axis, per order; on a turntable, on a surface half-way
    /// between the axis and the nearest calibrated depth.
    pub rows_per_mm: f64,
    /// Points per mm along a line.
    pub points_per_mm_along_line: f64,
    /// Points per mm² on a flat part perpendicular to the camera axis, per order.
    pub points_per_mm2: f64,
    /// Maximum number of points in the cloud.
    pub max_points: u64,
    /// Predicted standard deviation of a point along its camera ray, mm, from image noise on matt grey paint and the
    /// calibration; absent if the calibrated depths are out of view.
    pub predicted_sigma_mm: Option<f64>,
    /// Depth range (z of the camera frame) for the part, mm: nearest and farthest.
    pub depth_mm: [f64; 2],
    /// Depth range in which the image position of a line alone determines its order, mm; beyond it, a surface must be seen
    /// twice.
    pub unambiguous_depth_mm: [f64; 2],
    /// Disk space needed, bytes.
    pub disk_bytes: u64,
    /// Notes for the operator before the start.
    pub notes: Vec<String>,
}

impl ScanPlan {
    /// Whether frames captured with `other` and with this plan can belong to one scan.
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
