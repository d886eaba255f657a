//! Limits and durations of the checks, with their reasons.

use std::time::Duration;

/// Longest wait for the devices to open; a driver that takes longer has hung.
pub const OPENING_WAIT: Duration = Duration::from_secs(8);

/// Longest wait for laser and stage to confirm a Stop; after this time the station reports a fault of a stage that does not
/// brake.
pub const REST_WAIT: Duration = Duration::from_secs(2);

/// Longest wait for a cancelled examination to end, unless it waits at the prompt: it waits for the confirmation of the
/// Stop, after the step that was running.
pub const CANCELLED_WAIT: Duration = REST_WAIT.saturating_add(Duration::from_secs(1));

/// Frames of the free run: four seconds at 30 Hz.
pub const FREE_RUN_FRAMES: usize = 120;
/// Maximum duration of the free run: fifty frames at 5 Hz.
pub const FREE_RUN_TIME: Duration = Duration::from_secs(10);

/// Minimum number of frames for rate and jitter.
pub const FEWEST_FRAMES: usize = 10;

/// Longest wait for a frame before checking for cancellation.
pub const FRAME_WAIT: Duration = Duration::from_millis(50);

/// Minimum ratio of measured to set frame rate: links and oscillators are better than two percent.
pub const MIN_RATE_RATIO: f64 = 0.98;

/// Largest standard deviation of frame times about a steady rate, µs: 10 µm of stage travel at 10 mm/s.
pub const JITTER_US: f64 = 1000.0;

/// Laser-off images for the noise; with thousands of pixels, they determine it to a few percent.
pub const DARK_FRAMES: usize = 8;

/// Maximum fraction of hot pixels without a dark frame; sensors are sold with fewer.
pub const MAX_HOT_FRACTION: f64 = 1e-4;

/// Maximum standard deviation of the fixed pattern without a dark frame, percent of full scale: one level of 255, below the
/// noise of most cameras.
pub const PATTERN_PERCENT: f64 = 0.4;

/// Maximum dark noise of a pixel, percent of full scale; lines are detected down to five times the noise.
pub const DARK_NOISE_PERCENT: f64 = 2.0;

/// Maximum mean level with the laser off, percent of full scale; ambient light reduces the range left for the lines.
pub const AMBIENT_PERCENT: f64 = 25.0;

/// Factors of the set exposure at which linearity is checked.
pub const EXPOSURE_FACTORS: [f64; 2] = [0.5, 0.25];

/// Range of the laser light of pixels used for linearity, percent of full scale; below it noise and rounding dominate,
/// above it saturation.
pub const RESPONSE_PERCENT: (f64, f64) = (15.0, 85.0);

/// Minimum number of such pixels.
pub const FEWEST_PIXELS: usize = 200;

/// Maximum deviation from proportionality between light and exposure time, percent; a gamma of 2.2 causes 88.
pub const LINEARITY_PERCENT: f64 = 5.0;

/// Permitted full width of a line at half maximum, px. Narrower lines have errors that depend on their sub-pixel position,
/// wider ones are located less accurately.
pub const LINE_WIDTH_PX: (f64, f64) = (1.5, 15.0);

/// Minimum number of line points in an image: a quarter of one line across a small sensor.
pub const FEWEST_POINTS: usize = 100;

/// Maximum percentage of line points with saturated pixels.
pub const SATURATED_PERCENT: f64 = 5.0;

/// The laser must turn off within this time on command (promise 3).
pub const OFF_ON_COMMAND: Duration = Duration::from_millis(500);

/// The laser must turn off within this time if no frame is requested (promise 3: a lease of at most one second).
pub const OFF_WITHOUT_FRAMES: Duration = Duration::from_secs(1);

/// Maximum remaining light with the laser off, percent: the effect of noise.
pub const LIGHT_LEFT_PERCENT: f64 = 5.0;

/// Distance of the stage move, mm: a few squares of a board, a thousand motor steps.
pub const MOVE_MM: f64 = 10.0;

/// Maximum difference between read-back and commanded position, in addition to the resolution of the stage, mm.
pub const POSITION_MM: f64 = 0.02;

/// Maximum scale error of the stage, percent: a wrong number of steps per millimetre causes more, the uncalibrated lens
/// less.
pub const SCALE_PERCENT: f64 = 1.0;

/// Maximum scatter of the displacement over the corners, as a fraction of the displacement; beyond it, the board is not
/// aligned with the travel.
pub const MAX_DISPLACEMENT_SCATTER: f64 = 0.02;

/// Factors of the set exposure at which the board is searched: a laser is brighter than room light.
pub const BOARD_EXPOSURES: [f64; 4] = [1.0, 4.0, 16.0, 64.0];
