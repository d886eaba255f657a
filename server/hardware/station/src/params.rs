//! Times and sizes of the station thread, each with its reason.

use std::time::Duration;

/// Longest wait for a frame or a command while the thread may be needed; a Stop is noticed within this time.
pub const CYCLE_TIME: Duration = Duration::from_millis(4);

/// Time within which the station thread must handle a Stop before the guard stops the devices directly. Longer than a
/// cycle in which every call takes its longest permitted time, and much shorter than the 200 ms within which light and
/// motion must end.
pub const STOP_GUARD_DELAY: Duration = Duration::from_millis(60);

/// Longest wait of an idle thread; a Stop or a command wakes it.
pub const IDLE_CYCLE_TIME: Duration = Duration::from_millis(50);

/// Capacity of the command channel. Only people and one job send commands; more than this is a defect of the caller.
pub const COMMAND_CAPACITY: usize = 32;

/// Commands handled per cycle before frames and devices are serviced again; a Stop is checked before each.
pub const COMMANDS_PER_CYCLE: usize = 8;

/// Frames by which a job's recorder may lag: two seconds at 30 Hz.
pub const RECORDER_FRAMES: usize = 64;

/// Frames by which a recording may lag: write-back can block a writer for up to a fifth of a second.
pub const TAP_FRAMES: usize = 32;

/// Frame buffers: a full recorder queue, a full tap queue, a dozen for viewers and the job, and a dozen that the job
/// keeps for its next frames.
pub const FRAME_BUFFERS: usize = RECORDER_FRAMES + TAP_FRAMES + 24;

/// Interval between position readings while the stage moves: 0.1 mm at 20 mm/s; frames are interpolated between
/// readings.
pub const POLL_MOVING: Duration = Duration::from_millis(5);

/// Interval between readings of stage and laser at rest: faults of serial devices must be reported within a second.
pub const POLL_IDLE: Duration = Duration::from_millis(100);

/// Interval between readings of the laser while it is on.
pub const POLL_LASER_ON: Duration = Duration::from_millis(50);

/// Interval between probes of a camera that does not expose: an unplugged camera must be reported within two seconds.
pub const PROBE_CAMERA: Duration = Duration::from_millis(250);

/// Interval between readings of the laser until it reports the requested state.
pub const POLL_LASER_SWITCHING: Duration = Duration::from_millis(5);

/// Position readings kept for interpolation; 64 readings span 0.3 s at the fastest rate, 1.3 s at 50 Hz.
pub const TRACK_READINGS: usize = 64;

/// Longest time a frame waits for the position reading after it; firmware reports every 20–100 ms while moving.
pub const POSITION_WAIT: Duration = Duration::from_millis(250);

/// Silence of a free-running camera that counts as a fault; with short exposures it is reported within two seconds.
pub const CAMERA_SILENCE: Duration = Duration::from_millis(1500);

/// Longest wait for a frame that a simulated camera is still rendering: on a busy computer it is late without being
/// faulty. Does not apply to cameras that do not render.
pub const RENDERING_LIMIT: Duration = Duration::from_secs(15);

/// Frame periods of silence that count as a fault for slow cameras.
pub const SILENT_PERIODS: f64 = 3.0;

/// Frame periods without a complete frame that count as a fault of a slow camera while incomplete ones arrive: where every
/// second frame is lost, so many in a row are by chance once in a thousand.
pub const INCOMPLETE_PERIODS: f64 = 10.0;

/// Wait for a triggered frame beyond its exposure; twice this and two exposures stay below two seconds.
pub const GRAB_WAIT: Duration = Duration::from_millis(800);

/// Permitted deviation of the position read back from the target beyond the stage's resolution: firmware reports
/// thousandths of a millimetre.
pub const REPORT_ROUNDING_MM: f64 = 0.001;

/// Wait for the position read back to reach the target after the stage reports rest.
pub const SETTLE_LIMIT: Duration = Duration::from_millis(500);

/// A move without progress for this time has stalled; serial faults must be reported within a second.
pub const NO_PROGRESS_LIMIT: Duration = Duration::from_millis(700);

/// Time a move may take in addition to distance over speed.
pub const MOVE_MARGIN: Duration = Duration::from_millis(800);

/// Longest homing: one metre at a slow seek of 20 mm/s.
pub const HOMING_LIMIT: Duration = Duration::from_secs(60);

/// Longest time to come to rest after a stop, beyond the ramp.
pub const REST_LIMIT: Duration = Duration::from_secs(2);

/// Silence after which a jog stops; leaves 100 ms for the command and the ramp within the promised 300 ms.
pub const JOG_SILENCE: Duration = Duration::from_millis(200);

/// Run-up of a sweep if the stage does not report its acceleration.
pub const RUN_UP_TIME: Duration = Duration::from_millis(100);

/// Factor on the ramp length, so that the speed is constant when the range begins.
pub const RUN_UP_MARGIN: f64 = 1.25;

/// Lease requested from the laser; without a running thread the laser turns off within this time (promised: one
/// second).
pub const LIGHT_LEASE: Duration = Duration::from_millis(600);

/// Interval between renewals: two may fail before the lease expires.
pub const LIGHT_RENEWAL: Duration = Duration::from_millis(150);

/// The laser is turned off this long after the last due frame (promised: half a second; the rest is the thread's cycle
/// and the cable).
pub const LIGHT_IDLE: Duration = Duration::from_millis(350);

/// From the end of an exposure to its frame: 12 megapixels over Gigabit Ethernet.
pub const FRAME_TRANSFER: Duration = Duration::from_millis(100);

/// Wait for the laser to report light after it was switched on.
pub const LIGHT_UP_LIMIT: Duration = Duration::from_millis(700);

/// An unwatched live view ends after this time.
pub const LIVE_UNWATCHED: Duration = Duration::from_secs(30);

/// The laser of an unwatched live view is turned off after this time (promised: five seconds).
pub const LIVE_LIGHT_UNWATCHED: Duration = Duration::from_secs(4);

/// Time for which a reset tries to reconnect devices: a controller that restarts when its port is opened takes two
/// seconds.
pub const RESET_LIMIT: Duration = Duration::from_secs(4);

/// A driver that has not opened its devices within this time hangs or has much to read; the other devices are installed
/// without it. A controller that restarts when its port is opened takes four seconds.
pub const OPENING_LIMIT: Duration = Duration::from_secs(6);

/// Time for which the start of the service waits for the devices: it must be ready within five seconds.
pub const START_WAIT: Duration = Duration::from_secs(4);

/// Interval between status messages in which only numbers changed.
pub const STATUS_PERIOD: Duration = Duration::from_millis(100);

/// Greatest age of a running job's newest frame that still serves as a snapshot.
pub const SNAPSHOT_AGE: Duration = Duration::from_secs(2);

/// Greatest number of faults shown; the first ones explain the later ones.
pub const FAULTS_SHOWN: usize = 8;
