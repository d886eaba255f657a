//! Limits and paces of the drivers, each with its reason.

use std::time::Duration;

/// Slowest replay, Hz: one frame in ten seconds, for looking at single frames.
pub const REPLAY_MIN_RATE_HZ: f64 = 0.1;

/// Fastest timed replay, Hz; faster than any camera of this field, and twice what the service is to keep up with.
pub const REPLAY_MAX_RATE_HZ: f64 = 1000.0;

/// Speed reported for a replayed stage, mm/s; what it accepts has no effect, its positions come from the recording.
pub const REPLAY_MAX_SPEED_MM_S: f64 = 1000.0;

/// A replayed stage states its resolution in nanometres: steps that are added up from it end where they should.
pub const REPLAY_RESOLUTION_DIGITS_PER_MM: f64 = 1e6;

/// Most memory that preloaded pictures may take, bytes: 1,600 frames of 1280×1024, half of a small computer.
pub const PRELOAD_LIMIT_BYTES: usize = 2 << 30;

/// How far a replayed frame may be late before the pace starts anew at the present; less is caught up.
pub const REPLAY_CATCH_UP: Duration = Duration::from_millis(100);

/// Status queries of a GRBL controller at rest, Hz: enough to notice silence within a second, and little traffic.
pub const GRBL_IDLE_QUERY_HZ: f64 = 5.0;

/// Status queries during a motion, Hz, unless configured: the station interpolates frame positions between reports.
/// GRBL answers within 5–20 ms (`interface.md`), so that twice as many would queue up.
pub const GRBL_MOVING_QUERY_HZ: f64 = 25.0;

/// Pace of queries while a stop brakes: the reset that ends it waits for the report of rest.
pub const GRBL_BRAKING_QUERY: Duration = Duration::from_millis(10);

/// A query or soft reset unanswered so long is silence. With [`GRBL_IDLE_QUERY_HZ`] it is noticed within 0.9 s.
pub const GRBL_SILENCE: Duration = Duration::from_millis(650);

/// Longest wait for the answer to a line within a caller's own call; later answers come through `poll`.
pub const ANSWER_WAIT: Duration = Duration::from_millis(15);

/// `M5` not acknowledged so long is followed by a soft reset, which turns the laser off for sure.
pub const GRBL_DARK_LIMIT: Duration = Duration::from_millis(200);

/// Longest braking before a soft reset cuts it short, at the price of the position, while the laser is on: it must be
/// dark in 0.5 s.
pub const GRBL_LIT_BRAKING: Duration = Duration::from_millis(300);

/// A line may be acknowledged so late while reports come: `M3`, `M5`, `G4` and settings wait for motions, and a spindle
/// may take its time to spin up. Silence is found by queries, not by this.
pub const GRBL_ANSWER_LIMIT: Duration = Duration::from_secs(30);

/// A move, a homing or an unlocking that is not acknowledged while reports show rest for so long was lost, or its answer
/// was: at rest the firmware takes lines within milliseconds.
pub const GRBL_LINE_LOST: Duration = Duration::from_millis(400);

/// How old the position in a report may be beyond the time from question to answer.
pub const GRBL_REPORT_AGE: Duration = Duration::from_millis(5);

/// After the pause of a limit alarm it is waited so long for its message before the reset is sent without it.
pub const GRBL_RESET_AGAIN: Duration = Duration::from_millis(100);

/// Longest braking that is waited for, seconds: 100 mm/s at the 10 mm/s² that grblHAL is delivered with.
pub const GRBL_BRAKING_S: f64 = 10.0;

/// What braking may take beyond speed over acceleration: the report of rest, twice.
pub const GRBL_BRAKING_SLACK: Duration = Duration::from_millis(100);

/// A moving stage whose position does not change so long stalls. Ten reports at the slowest pace in use.
pub const GRBL_STALL: Duration = Duration::from_millis(500);

/// Idle short of the target so long after the move was taken is a stall: the controller starts a move within one
/// turn of its main loop (`protocol.c`), a few milliseconds.
pub const GRBL_START: Duration = Duration::from_millis(150);

/// Soft resets while a controller is opened come at this pace: a board that restarts when its port is opened
/// swallows what comes before its firmware runs.
pub const GRBL_RESET_PERIOD: Duration = Duration::from_millis(500);

/// Quiet after a banner before the dialogue begins: the banner of switching on may be followed by that of the
/// driver's own reset.
pub const GRBL_BANNER_SETTLING: Duration = Duration::from_millis(50);

/// Lines that are not the protocol, within [`GRBL_GARBAGE_WINDOW`], before the link is given up. A single flipped
/// bit is survived.
pub const GRBL_GARBAGE_LINES: usize = 3;

/// See [`GRBL_GARBAGE_LINES`]; three answers at the idle pace fall into it.
pub const GRBL_GARBAGE_WINDOW: Duration = Duration::from_secs(1);

/// A line that was begun so long ago and has not ended is none of the protocol's: the longest takes 20 ms at 115200 baud.
pub const GRBL_LINE_TIME: Duration = Duration::from_millis(200);

/// Longest line that can be the protocol; GRBL's own buffer is 80 characters, grblHAL's reports stay below 200.
pub const GRBL_LINE_BYTES: usize = 512;

/// Reports that show power while it should be dark, before it is taken for real: the first may have been under way.
pub const GRBL_STRAY_REPORTS: usize = 2;

/// Longest line of the other serial protocols: 80 bytes of Zaber's, a few hundred of Marlin's capabilities.
pub const SERIAL_LINE_BYTES: usize = 512;

/// Position queries of a Zaber device during a motion, Hz, unless configured. It answers at once; query and answer are
/// fifty bytes, 5 ms at 115200 baud.
pub const ZABER_MOVING_QUERY_HZ: f64 = 25.0;

/// Position queries of a Zaber device at rest, Hz.
pub const ZABER_IDLE_QUERY_HZ: f64 = 5.0;

/// Pace of queries while a stop brakes.
pub const ZABER_BRAKING_QUERY: Duration = Duration::from_millis(15);

/// A command unanswered so long is silence, and so is a line on which no query was answered for so long. A Zaber device
/// answers every command at once, whatever it does.
pub const ZABER_SILENCE: Duration = Duration::from_millis(650);

/// A query that was not answered is followed by another after this time: its answer may have come damaged.
pub const ZABER_QUERY_AGAIN: Duration = Duration::from_millis(150);

/// Damaged or foreign lines, within a second, before the link is given up.
pub const ZABER_GARBAGE_LINES: usize = 3;

/// A moving axis whose position does not change so long stalls.
pub const ZABER_STALL: Duration = Duration::from_millis(500);

/// How often the serial number is asked for: another device on the line is found within this time.
pub const ZABER_IDENTITY_PERIOD: Duration = Duration::from_millis(500);

/// Settling at the end of a move may leave so many microsteps.
pub const ZABER_SETTLED_STEPS: f64 = 2.0;

/// Position queries of a Marlin controller during a motion, Hz, unless configured: question and answer take 10 ms at
/// 115200 baud, and moves are sent between them.
pub const MARLIN_MOVING_QUERY_HZ: f64 = 20.0;

/// Position queries of a Marlin controller at rest, Hz.
pub const MARLIN_IDLE_QUERY_HZ: f64 = 5.0;

/// Time that one piece of a move takes.
pub const MARLIN_PIECE: Duration = Duration::from_millis(40);

/// Pieces are sent ahead of the motor for this time, beyond the way it needs to brake: so long a stop runs out.
pub const MARLIN_AHEAD: Duration = Duration::from_millis(110);

/// A line unanswered so long is silence, where the firmware has no reason to take its time.
pub const MARLIN_SILENCE: Duration = Duration::from_millis(650);

/// While a line takes its time, `echo:busy` comes in this period (`M113`); it is missed after this and
/// [`MARLIN_SILENCE`].
pub const MARLIN_KEEPALIVE_S: u64 = 1;

/// What a run-out may take beyond pieces and ramp: the first block waits 0.1 s for more, and the report of rest.
pub const MARLIN_STOP_SLACK: Duration = Duration::from_millis(400);

/// After a quick stop (`M410`) the firmware drops moves and waits for a second.
pub const MARLIN_QUICK_STOP: Duration = Duration::from_millis(1500);

/// `M5` not acknowledged so long at rest is followed by `M112`, which turns the laser off for good.
pub const MARLIN_DARK_LIMIT: Duration = Duration::from_millis(250);

/// A lit laser at rest is kept from the firmware's safety timeout (1 s as delivered) at this pace.
pub const MARLIN_LIGHT_KEEPALIVE: Duration = Duration::from_millis(400);

/// Behind `Resend` an `ok` may follow, which answers nothing: it is waited for so long.
pub const MARLIN_RESEND_PAUSE: Duration = Duration::from_millis(40);

/// How often a line is sent again on request before the link is given up.
pub const MARLIN_RESENDS: u32 = 5;

/// While it is opened, the questions come again at this pace: a board that restarts swallows them.
pub const MARLIN_OPENING_PERIOD: Duration = Duration::from_millis(1300);

/// So long nothing must come before the numbered dialogue begins.
pub const MARLIN_QUIET: Duration = Duration::from_millis(80);
