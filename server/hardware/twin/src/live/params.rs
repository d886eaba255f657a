//! Constants of the live station, each with its unit and reason.

use std::time::Duration;

use devices::ValueRange;

/// Exposure at which the target's white reaches [`crate::params::BOARD_WHITE_LEVEL`] under ambient light, µs.
pub const BOARD_EXPOSURE_US: f64 = 20_000.0;

/// Exposure at which laser lines reach the shape's `line_peak` at full power, µs: the laser line is twenty times
/// brighter than the board illumination.
pub const LASER_EXPOSURE_US: f64 = 1_000.0;

/// Exposure range of the sensor, µs.
pub(super) const EXPOSURE_US: ValueRange = ValueRange { min: 10.0, max: 1_000_000.0 };

/// Gain range, dB.
pub(super) const GAIN_DB: ValueRange = ValueRange { min: 0.0, max: 24.0 };

/// Range of frame rates, Hz. At higher rates one core cannot render frames in time.
pub(super) const FRAME_RATE_HZ: ValueRange = ValueRange { min: 0.1, max: 120.0 };

/// Frame rate of a camera just opened, Hz.
pub(super) const FRAME_RATE_AT_OPEN_HZ: f64 = 30.0;

/// Frames kept until they are collected, as in the ring buffer of a real driver.
pub(super) const RING_FRAMES: usize = 4;

/// Software triggers that may be pending; beyond, the camera reports that it is not ready.
pub(super) const PENDING_TRIGGERS: usize = 16;

/// Read-out of a frame with realistic timing: 1024 rows at 10 µs.
pub(super) const READ_OUT: Duration = Duration::from_millis(10);

/// Speed of a move without delays, mm/s.
pub(super) const INSTANT_SPEED_MM_S: f64 = 1e6;

/// Fastest move of a real belt or spindle axis, mm/s.
pub(super) const REALISTIC_SPEED_MM_S: f64 = 100.0;

/// Acceleration of such an axis, mm/s².
pub(super) const REALISTIC_ACCELERATION_MM_S2: f64 = 500.0;

/// Homing speed, mm/s.
pub(super) const HOMING_SPEED_MM_S: f64 = 40.0;

/// Pull-off distance of homing from the switch at the low end of the travel, mm.
pub(super) const HOMING_PULL_OFF_MM: f64 = 1.0;

/// Smallest step, mm: positions are floating-point numbers and reached as commanded.
pub(super) const RESOLUTION_MM: f64 = 1e-6;

/// Distance before an obstacle at which the carriage comes to rest, mm.
pub(super) const STALL_GAP_MM: f64 = 0.01;

/// Ringing after a stop from full acceleration: amplitude, mm.
pub(super) const RING_AMPLITUDE_MM: f64 = 0.01;

/// Decay time of the ringing, s.
pub(super) const RING_DECAY_S: f64 = 0.04;

/// Frequency of the ringing, Hz.
pub(super) const RING_FREQUENCY_HZ: f64 = 25.0;

/// Reply timeout of a silent stage, ms; the driver's own limit.
pub(super) const SILENCE_MS: u64 = 500;

/// Powers to which the laser can be set.
pub(super) const LASER_POWER: ValueRange = ValueRange { min: 0.01, max: 1.0 };

/// Grey levels (of 255, on white, at full power and [`LASER_EXPOSURE_US`]) of the light scattered over the scene by an
/// entirely dirty grating.
pub(super) const STRAY_LEVELS: f64 = 40.0;

/// Position of a belt at the first trigger of an acquisition, mm.
pub const BELT_START_MM: f64 = -20.0;
