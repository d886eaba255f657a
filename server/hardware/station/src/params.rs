//! Times and sizes of the station thread, each with its reason.

use std::time::Duration;

/// Longest wait for a frame or a command while something may need the thread: a stop is seen within this time.
pub const TURN: Duration = Duration::from_millis(4);

/// How long a Stop may wait for the station thread before the devices are stopped past it: more than a turn takes with
/// every call as long as it may be, and much less than the 200 ms in which light and motion are to have ended.
pub const STOP_PATIENCE: Duration = Duration::from_millis(60);

/// Longest wait of an idle thread; a stop or a command wakes it.
pub const IDLE_TURN: Duration = Duration::from_millis(50);

/// Commands that may wait. People and one job talk to the station; more than this is a defect of the caller.
pub const COMMANDS: usize = 32;

/// Commands obeyed in one turn before frames and devices are tended again; a stop is looked for before each.
pub const COMMANDS_PER_TURN: usize = 8;

/// Frames a job's recorder may lag behind: two seconds at 30 Hz.
pub const RECORDER_FRAMES: usize = 64;

/// Frames that a recording may lag behind: a system that writes back lets a writer wait up to a fifth of a second.
pub const TAP_FRAMES: usize = 32;

/// Buffers for frames: a full recorder, a full tap, a dozen in the hands of viewers and of the job, and a dozen in memory that the
/// job keeps for the next frames.
pub const FRAME_BUFFERS: usize = RECORDER_FRAMES + TAP_FRAMES + 24;

/// Time between position readings while the stage moves: 0.1 mm at 20 mm/s, between which frames are interpolated.
pub const POLL_MOVING: Duration = Duration::from_millis(5);

/// Time between readings of stage and laser at rest: faults of serial devices are to be named within a second.
pub const POLL_IDLE: Duration = Duration::from_millis(100);

/// Time between readings of the laser while it is on.
pub const POLL_SHINING: Duration = Duration::from_millis(50);

/// Time between questions to a camera that does not expose: an unplugged one is to be named within two seconds.
pub const PROBE_CAMERA: Duration = Duration::from_millis(250);

/// Time between readings of the laser until it reports what was asked of it.
pub const POLL_CHANGING: Duration = Duration::from_millis(5);

/// Position readings kept for interpolation; 64 readings span 0.3 s at the fastest rate, 1.3 s at 50 Hz.
pub const TRACK_READINGS: usize = 64;

/// How long a frame waits for the position reading after it; firmware reports every 20–100 ms while moving.
pub const POSITION_WAIT: Duration = Duration::from_millis(250);

/// Silence of a free-running camera that counts as a fault; with short exposures named within two seconds.
pub const CAMERA_SILENCE: Duration = Duration::from_millis(1500);

/// Longest wait for a frame that a simulated camera is still computing: a computer with other work to do is late
/// without any fault. A camera that computes nothing gets none of it.
pub const RENDERING_PATIENCE: Duration = Duration::from_secs(15);

/// Frame periods of silence that count as a fault with slow cameras.
pub const SILENT_PERIODS: f64 = 3.0;

/// Wait for a triggered frame beyond its exposure; twice this and two exposures stay below two seconds.
pub const GRAB_WAIT: Duration = Duration::from_millis(800);

/// How far the position read back may be from the target beyond the stage's resolution: firmware reports
/// thousandths of a millimetre.
pub const REPORT_ROUNDING_MM: f64 = 0.001;

/// Wait for the read-back position to reach the target once the stage reports rest.
pub const SETTLE_LIMIT: Duration = Duration::from_millis(500);

/// A move that makes no progress for this long has stalled; serial faults are to be named within a second.
pub const NO_PROGRESS_LIMIT: Duration = Duration::from_millis(700);

/// What a move may take beyond its distance over its speed.
pub const MOVE_MARGIN: Duration = Duration::from_millis(800);

/// Longest homing: a metre at the 20 mm/s of a slow seek.
pub const HOMING_LIMIT: Duration = Duration::from_secs(60);

/// Longest way to rest after a stop, beyond its ramp.
pub const REST_LIMIT: Duration = Duration::from_secs(2);

/// Silence after which a jog stops; leaves 100 ms for the byte and the ramp within the promised 300 ms.
pub const JOG_SILENCE: Duration = Duration::from_millis(200);

/// Run-up of a sweep if the stage does not state its acceleration.
pub const RUN_UP_TIME: Duration = Duration::from_millis(100);

/// Run-up beyond the ramp by its own length, so that speed has settled.
pub const RUN_UP_MARGIN: f64 = 1.25;

/// Lease asked of the laser; light without a living thread ends within this time (promised: one second).
pub const LIGHT_LEASE: Duration = Duration::from_millis(600);

/// Time between renewals: two may fail before the lease ends.
pub const LIGHT_RENEWAL: Duration = Duration::from_millis(150);

/// Light goes out so long after the last frame that was due (promised: half a second; the rest is the turn of the
/// thread and the cable).
pub const LIGHT_IDLE: Duration = Duration::from_millis(350);

/// From the end of an exposure to its frame: 12 megapixels over Gigabit Ethernet.
pub const FRAME_TRANSFER: Duration = Duration::from_millis(100);

/// Wait for the laser to report light after it was switched on.
pub const LIGHT_UP_LIMIT: Duration = Duration::from_millis(700);

/// A live view that nobody watches ends after this time.
pub const LIVE_UNWATCHED: Duration = Duration::from_secs(30);

/// Light of a live view that nobody watches goes out after this time (promised: five seconds).
pub const LIVE_LIGHT_UNWATCHED: Duration = Duration::from_secs(4);

/// How long a reset tries to reach devices again: a controller that restarts with its port takes two seconds.
pub const RESET_LIMIT: Duration = Duration::from_secs(4);

/// A driver that has not opened its devices for so long hangs, or has much to read: the other devices come without it.
/// A controller that restarts with its port takes four.
pub const OPENING_LIMIT: Duration = Duration::from_secs(6);

/// How long the start of the service waits for the devices: it is to be ready within five seconds.
pub const START_WAIT: Duration = Duration::from_secs(4);

/// Time between status messages of which only numbers changed.
pub const STATUS_PERIOD: Duration = Duration::from_millis(100);

/// Age up to which a running job's newest frame serves as a snapshot.
pub const SNAPSHOT_AGE: Duration = Duration::from_secs(2);

/// Faults shown at most; the first ones explain the later ones.
pub const FAULTS_SHOWN: usize = 8;
