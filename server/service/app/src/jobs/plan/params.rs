//! Limits and estimates for planning scans, each with its unit and reason.

use std::ops::RangeInclusive;

/// Default distance between rows, mm: two to three pixels of a megapixel camera at 400 mm.
pub const DEFAULT_STEP_MM: f64 = 0.2;

/// Default angle between rows on a turntable, degrees: 0.3 mm on a part of 40 mm radius.
pub const DEFAULT_STEP_DEG: f64 = 0.5;

/// Default laser power, fraction of full power.
pub const DEFAULT_LASER_POWER: f64 = 1.0;

/// Scan angle that shows the closure of a turn, degrees: surfaces are seen again over the last fifteen.
pub const CLOSING_TURN_DEG: f64 = 375.0;

/// Smallest step, mm or degrees: below it, rows differ by less than the read-back resolution of any stage.
pub const STEP_MIN: f64 = 0.001;

/// Minimum row spacing as a fraction of the stage resolution: users give round numbers, whereas the mean spacing of
/// recorded positions is not round.
pub const RESOLUTION_RATIO: f64 = 0.999;

/// Maximum number of points of a planned scan. Computing the cloud takes 63.5 bytes per point: 0.6 GB.
pub const POINTS_LIMIT: u64 = 10_000_000;

/// Standard deviation of a centreline point, px, for predicting σ: the median on matt grey paint at a good exposure
/// (twin, speckle contrast 0.3).
pub const EXPECTED_SIGMA_PX: f64 = 0.05;

/// Default overhead per row of a stop-and-go scan, s: trigger, read-out, transfer, settling.
pub const ROW_OVERHEAD_S: f64 = 0.03;

/// Motion blur during an exposure, as a fraction of the step, above which the plan has a note.
pub const SMEAR_FRACTION: f64 = 0.25;

/// Spacing of the pixels at which σ and density are predicted, px; both change slowly over the image.
pub const PREDICTION_STEP_PX: usize = 64;

/// Bytes of a display point in the blocks of the stream.
pub const DISPLAY_POINT_BYTES: u64 = 16;

/// Bytes of a point in a cloud as binary PLY.
pub const CLOUD_POINT_BYTES: u64 = 45;

/// Bytes of a point in the peaks.
pub const PEAK_BYTES: u64 = 49;

/// Time from the centrelines of a frame to stored points on a machine that has not scanned yet, s: five orders of a
/// megapixel camera on two cores.
pub const EVALUATION_S_PER_FRAME: f64 = 0.03;

/// Time of a measurement on a machine that has not measured yet, s.
pub const MEASURING_S: f64 = 1.5;

/// Default number of times that the evaluation reads each frame: labels, surfaces, points.
pub const PASSES: f64 = 3.0;

/// Number of recent scans used for durations: enough to tolerate an outlier, few enough to follow a change.
pub const PACE_SCANS: u32 = 9;

/// Allowed number of exposures per row: two cover a range of 60 : 1 with 8 bits, more than four are not worth the time.
pub const EXPOSURES: RangeInclusive<usize> = 2..=4;

/// Minimum ratio of two exposures: closer ones add no information.
pub const LEAST_EXPOSURE_RATIO: f64 = 1.5;
