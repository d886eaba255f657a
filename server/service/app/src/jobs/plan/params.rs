//! Limits and estimates of the planning of scans, each with its unit and its reason.

use std::ops::RangeInclusive;

/// Distance between rows if nothing else is said, mm: two to three pixels of a megapixel camera at 400 mm.
pub const DEFAULT_STEP_MM: f64 = 0.2;

/// Angle between rows on a turntable if nothing else is said, degrees: 0.3 mm on a part of 40 mm radius.
pub const DEFAULT_STEP_DEG: f64 = 0.5;

/// Share of full laser power if nothing else is said.
pub const DEFAULT_LASER_POWER: f64 = 1.0;

/// Angle of a scan that shows how well a turn closes, degrees: places are seen again over the last fifteen.
pub const CLOSING_TURN_DEG: f64 = 375.0;

/// Smallest step, mm or degrees: below, rows differ by less than any stage can be read back.
pub const STEP_MIN: f64 = 0.001;

/// Share of a stage's own resolution that rows must at least be apart: people give round numbers, and the mean distance
/// of recorded positions is none.
pub const RESOLUTION_SHARE: f64 = 0.999;

/// Largest number of points a scan may be planned for. Computing the cloud takes at most 64 bytes for each of them:
/// 640 MB.
pub const POINTS_LIMIT: u64 = 10_000_000;

/// Standard deviation of a centreline's point, px, that σ is predicted with: the median on matt grey paint at a
/// well-set exposure (twin, speckle contrast 0.3).
pub const EXPECTED_SIGMA_PX: f64 = 0.05;

/// Time a row of a stop-and-go scan takes beside motion and exposure, s: trigger, read-out, transfer, settling.
pub const ROW_OVERHEAD_S: f64 = 0.03;

/// Largest smear during an exposure of a moving stage, as a share of the step, that is not worth a remark.
pub const SMEAR_SHARE: f64 = 0.25;

/// Distance of the pixels at which σ and density are predicted, px; both change slowly over the image.
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

/// How often the evaluation reads every frame where no scan has recorded it: labels, surfaces, points.
pub const PASSES: f64 = 3.0;

/// Scans whose times are learned from: enough that one odd one does not matter, few enough to follow a change.
pub const PACE_SCANS: u32 = 9;

/// Exposures that a row may have in place of one: two span 60 : 1 with 8 bits, more than four take longer than they gain.
pub const EXPOSURES: RangeInclusive<usize> = 2..=4;

/// An exposure that is not longer by this than another tells nothing that is not known.
pub const LEAST_EXPOSURE_RATIO: f64 = 1.5;
