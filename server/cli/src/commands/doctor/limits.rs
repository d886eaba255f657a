//! What a check is held to, and how long it takes: each with its reason.

use std::time::Duration;

/// Longest wait for the devices: a driver that has not come back by then hangs.
pub const OPENING_WAIT: Duration = Duration::from_secs(8);

/// Frames of the free run, and the longest it lasts: four seconds at 30 Hz, fifty frames of a camera of 5 Hz.
pub const FREE_RUN_FRAMES: usize = 120;
pub const FREE_RUN_TIME: Duration = Duration::from_secs(10);

/// Fewest frames that say something about rate and times.
pub const FEWEST_FRAMES: usize = 10;

/// Longest wait for one frame before it is looked whether the doctor was cancelled.
pub const FRAME_WAIT: Duration = Duration::from_millis(50);

/// Share of the frame rate set that must be reached: cables and quartzes are better than two in a hundred.
pub const RATE_REACHED: f64 = 0.98;

/// Largest standard deviation of frame times about a steady rate, µs: 10 µm of stage travel at 10 mm/s.
pub const JITTER_US: f64 = 1000.0;

/// Dark frames whose noise is looked at: the noise is known to a few percent from pixels in their thousands.
pub const DARK_FRAMES: usize = 8;

/// Largest share of hot pixels that goes without a dark frame: sensors are sold with fewer.
pub const HOT_SHARE: f64 = 1e-4;

/// Largest standard deviation of the fixed pattern that goes without a dark frame, percent of full scale: one level of 255,
/// below the noise of most cameras.
pub const PATTERN_PERCENT: f64 = 0.4;

/// Largest noise of a pixel in the dark, percent of full scale: lines are found down to five times that.
pub const DARK_NOISE_PERCENT: f64 = 2.0;

/// Largest mean level with the laser off, percent of full scale: what light of the room takes away from the lines.
pub const AMBIENT_PERCENT: f64 = 25.0;

/// Exposures tried against the one that is set.
pub const EXPOSURE_SHARES: [f64; 2] = [0.5, 0.25];

/// Pixels that say something about the response, by their level above dark at the exposure set, percent of full scale:
/// noise and rounding below, saturation above.
pub const RESPONSE_PERCENT: (f64, f64) = (15.0, 85.0);

/// Fewest such pixels.
pub const FEWEST_PIXELS: usize = 200;

/// Largest deviation from light in proportion to time, percent; a gamma curve of 2.2 makes 88.
pub const LINEARITY_PERCENT: f64 = 5.0;

/// Widths of a line at half its height, px: narrower ones are located with errors that depend on where they lie between
/// pixels, wider ones coarsely.
pub const LINE_WIDTH_PX: (f64, f64) = (1.5, 15.0);

/// Fewest points of lines in a picture: a quarter of one line across a small sensor.
pub const FEWEST_POINTS: usize = 100;

/// Largest share of a line's points with pixels at full scale, percent.
pub const SATURATED_PERCENT: f64 = 5.0;

/// Light goes off within this time when it is switched off (promise 3).
pub const OFF_ON_COMMAND: Duration = Duration::from_millis(500);

/// Light goes off within this time when no frame is due (promise 3: a lease of at most a second).
pub const OFF_BY_ITSELF: Duration = Duration::from_secs(1);

/// Share of the light that may be left when the laser is off, percent: what noise makes of nothing.
pub const LIGHT_LEFT_PERCENT: f64 = 5.0;

/// The way that the stage is moved, mm: a few squares of a board, a thousand steps of a motor.
pub const MOVE_MM: f64 = 10.0;

/// Largest difference of the position read back from the one commanded beyond the stage's resolution, mm.
pub const POSITION_MM: f64 = 0.02;

/// Largest deviation of the stage's scale, percent: a wrong number of steps is at least so much, and the lens, which is
/// not calibrated yet, makes no more.
pub const SCALE_PERCENT: f64 = 1.0;

/// Largest scatter of the way over the board's corners, share of the way: beyond, the board does not lie along it.
pub const WAY_SCATTER: f64 = 0.02;

/// Exposures at which the board is looked for, as multiples of the one set: a laser is brighter than a lamp.
pub const BOARD_EXPOSURES: [f64; 4] = [1.0, 4.0, 16.0, 64.0];
