//! Limits and rates of the drivers, each with its reason.

use std::time::Duration;

/// Slowest replay, Hz: one frame in ten seconds, for inspecting single frames.
pub const REPLAY_MIN_RATE_HZ: f64 = 0.1;

/// Fastest timed replay, Hz; faster than any camera of this field, and twice the rate that the service must sustain.
pub const REPLAY_MAX_RATE_HZ: f64 = 1000.0;

/// Speed reported for a replayed stage, mm/s; what it accepts has no effect, its positions come from the recording.
pub const REPLAY_MAX_SPEED_MM_S: f64 = 1000.0;

/// Resolution of a replayed stage is rounded to nanometres, so that sums of steps end where they should.
pub const REPLAY_RESOLUTION_DIGITS_PER_MM: f64 = 1e6;

/// Most memory for preloaded images, bytes: 1,600 frames of 1280×1024, half of a small computer.
pub const PRELOAD_LIMIT_BYTES: usize = 2 << 30;

/// Lateness of a replayed frame from which the schedule restarts at the present; less is caught up.
pub const REPLAY_CATCH_UP: Duration = Duration::from_millis(100);

/// Status queries of a GRBL controller at rest, Hz: enough to detect silence within a second, and little traffic.
pub const GRBL_IDLE_QUERY_HZ: f64 = 5.0;

/// Default status queries during a motion, Hz: the station interpolates frame positions between reports. GRBL answers
/// within 5–20 ms (`interface.md`), so that twice as many would queue up.
pub const GRBL_MOVING_QUERY_HZ: f64 = 25.0;

/// Query interval while a stop brakes: the reset that ends it waits for the report of rest.
pub const GRBL_BRAKING_QUERY: Duration = Duration::from_millis(10);

/// Time after which an unanswered query or soft reset counts as silence. With [`GRBL_IDLE_QUERY_HZ`] it is detected
/// within 0.9 s.
pub const GRBL_SILENCE: Duration = Duration::from_millis(650);

/// Longest wait for the answer to a line within a caller's call; later answers are reported by `poll`.
pub const ANSWER_WAIT: Duration = Duration::from_millis(15);

/// Time after which an unacknowledged `M5` is followed by a soft reset, which reliably turns the laser off.
pub const GRBL_LASER_OFF_LIMIT: Duration = Duration::from_millis(200);

/// Longest braking with the laser on before a soft reset cuts it short, at the cost of the position: the laser must be
/// off in 0.5 s.
pub const GRBL_LASER_ON_BRAKING: Duration = Duration::from_millis(300);

/// Longest wait for an acknowledgement while reports come: `M3`, `M5`, `G4` and settings wait for motions, and a
/// spindle may take time to spin up. Silence is detected by queries, not by this.
pub const GRBL_ANSWER_LIMIT: Duration = Duration::from_secs(30);

/// Time after which an unacknowledged move, homing or unlock counts as lost while reports show rest: at rest the
/// firmware accepts lines within milliseconds.
pub const GRBL_LINE_LOST: Duration = Duration::from_millis(400);

/// Age of the position in a report, in addition to the time from query to answer.
pub const GRBL_REPORT_AGE: Duration = Duration::from_millis(5);

/// Time after the pause of a limit alarm after which the reset is sent without waiting for its message.
pub const GRBL_RESET_AGAIN: Duration = Duration::from_millis(100);

/// Longest braking, seconds: from 100 mm/s at the 10 mm/s² that is grblHAL's default.
pub const GRBL_BRAKING_S: f64 = 10.0;

/// Braking time in addition to speed over acceleration: the report of rest, twice.
pub const GRBL_BRAKING_SLACK: Duration = Duration::from_millis(100);

/// Time without a change of the reported position after which a moving stage counts as stalled. Ten reports at the
/// slowest rate in use.
pub const STALL: Duration = Duration::from_millis(500);

/// Number of such reports that this takes as well: half of those at the slowest rate, so that damaged answers do not
/// delay it, and more than arrive after a pause of this computer.
pub const STALL_REPORTS: usize = 5;

/// Time after a move was accepted from which idle short of the target counts as a stall: the controller starts a move
/// within one pass of its main loop (`protocol.c`), a few milliseconds.
pub const GRBL_START: Duration = Duration::from_millis(150);

/// Interval of soft resets while a controller is being opened: a board that restarts when its port is opened loses
/// bytes received before its firmware runs.
pub const GRBL_RESET_PERIOD: Duration = Duration::from_millis(500);

/// Quiet time after a banner before the dialogue begins: the banner of power-on may be followed by that of the driver's
/// own reset.
pub const GRBL_BANNER_SETTLING: Duration = Duration::from_millis(50);

/// Number of damaged or foreign lines within [`FOREIGN_WINDOW`] at which the link to a serial controller is given up. A
/// single flipped bit is tolerated.
pub const FOREIGN_LINES: usize = 3;

/// See [`FOREIGN_LINES`]; it contains three answers at the idle rate.
pub const FOREIGN_WINDOW: Duration = Duration::from_secs(1);

/// Longest time from the first byte of a line to its end: the longest takes 20 ms at 115200 baud.
pub const GRBL_LINE_TIME: Duration = Duration::from_millis(200);

/// Longest line of the protocol; GRBL's own buffer is 80 characters, grblHAL's reports stay below 200.
pub const GRBL_LINE_BYTES: usize = 512;

/// Number of reports of power while the laser should be off after which it counts as real: the first may have been in
/// flight.
pub const GRBL_STRAY_REPORTS: usize = 2;

/// Longest line of the other serial protocols: 80 bytes of Zaber's, a few hundred of Marlin's capabilities.
pub const SERIAL_LINE_BYTES: usize = 512;

/// Default position queries of a Zaber device during a motion, Hz. It answers at once; query and answer are fifty
/// bytes, 5 ms at 115200 baud.
pub const ZABER_MOVING_QUERY_HZ: f64 = 25.0;

/// Position queries of a Zaber device at rest, Hz.
pub const ZABER_IDLE_QUERY_HZ: f64 = 5.0;

/// Query interval while a stop brakes.
pub const ZABER_BRAKING_QUERY: Duration = Duration::from_millis(15);

/// Time after which an unanswered command, or a line without an answered query, counts as silence. A Zaber device
/// answers every command at once in any state.
pub const ZABER_SILENCE: Duration = Duration::from_millis(650);

/// Interval after which an unanswered query is repeated: its answer may have been damaged.
pub const ZABER_QUERY_AGAIN: Duration = Duration::from_millis(150);

/// Interval of queries of the serial number: another device on the line is detected within this time.
pub const ZABER_IDENTITY_PERIOD: Duration = Duration::from_millis(500);

/// Largest settling error at the end of a move, microsteps.
pub const ZABER_SETTLED_STEPS: f64 = 2.0;

/// Default position queries of a Marlin controller during a motion, Hz: query and answer take 10 ms at 115200 baud, and
/// moves are sent between them.
pub const MARLIN_MOVING_QUERY_HZ: f64 = 20.0;

/// Position queries of a Marlin controller at rest, Hz.
pub const MARLIN_IDLE_QUERY_HZ: f64 = 5.0;

/// Duration of one piece of a move.
pub const MARLIN_PIECE: Duration = Duration::from_millis(40);

/// Time that pieces are sent ahead of the motor, beyond the braking distance: a stop runs out for so long.
pub const MARLIN_AHEAD: Duration = Duration::from_millis(110);

/// Time after which an unanswered line counts as silence, unless the firmware has a reason to take longer.
pub const MARLIN_SILENCE: Duration = Duration::from_millis(650);

/// Period of `echo:busy` messages during a long line (`M113`); its absence is detected after this and
/// [`MARLIN_SILENCE`].
pub const MARLIN_KEEPALIVE_S: u64 = 1;

/// Run-out time in addition to pieces and ramp: the first block waits 0.1 s for more, and the report of rest.
pub const MARLIN_STOP_SLACK: Duration = Duration::from_millis(400);

/// Time for which the firmware drops moves and waits after a quick stop (`M410`).
pub const MARLIN_QUICK_STOP: Duration = Duration::from_millis(1500);

/// Time after which an unacknowledged `M5` at rest is followed by `M112`, which turns the laser off permanently.
pub const MARLIN_LASER_OFF_LIMIT: Duration = Duration::from_millis(250);

/// Keep-alive interval of a laser that is on at rest, below the firmware's safety timeout (1 s by default).
pub const MARLIN_LIGHT_KEEPALIVE: Duration = Duration::from_millis(400);

/// Time to wait after `Resend` for an `ok` that answers nothing.
pub const MARLIN_RESEND_PAUSE: Duration = Duration::from_millis(40);

/// Number of requested resends of a line at which the link is given up.
pub const MARLIN_RESENDS: u32 = 5;

/// Interval at which the opening queries are repeated: a restarting board loses them.
pub const MARLIN_OPENING_PERIOD: Duration = Duration::from_millis(1300);

/// Silence required before the numbered dialogue begins.
pub const MARLIN_QUIET: Duration = Duration::from_millis(80);
