//! The table of states and commands in `server/docs/devices/grbl.md`, cell by cell, with a clock controlled by the
//! test.
//!
//! Not covered: that the firmwares behave like this. The table was derived from their sources.

use std::time::{Duration, Instant};

use super::dialect::Dialect::{self, FluidNc, Grbl, GrblHal};
use super::firmware::Firmware;
use super::{Event, SimulatorConfig};
use crate::simulators::simulator::{EventLog, Firmware as _};

/// A controller and its clock.
struct Bench {
    firmware: Firmware,
    event_log: EventLog,
    now: Instant,
}

/// A slow move, so that braking from it takes a millisecond and its end is far away.
const MOVE: &str = "G1F240M3S500X-90\n";
const JOG: &str = "$J=G53X-90F240\n";

/// Longer than every pause and braking, shorter than the moves.
const SETTLED_MS: u64 = 900;

impl Bench {
    fn of(config: SimulatorConfig) -> Self {
        let (event_log, now) = (EventLog::new(None).unwrap(), Instant::now());
        let mut bench = Self { firmware: Firmware::new(config, event_log.clone()), event_log, now };
        bench.firmware.power_on(now);
        bench.pass(SETTLED_MS);
        bench
    }

    /// Brings it to this state, at rest if possible; the output on the way is discarded.
    fn in_state(dialect: Dialect, state: &str) -> Self {
        Self::configured(SimulatorConfig::of(dialect), state)
    }

    fn configured(config: SimulatorConfig, state: &str) -> Self {
        let homing_mm_s = if state == "Home" { 1.0 } else { config.homing_mm_s };
        let mut bench = Self::of(SimulatorConfig { homing_mm_s, ..config });
        bench.send(if state == "Home" { "$H\n" } else { "$X\n" }, 5);
        match state {
            "Idle" | "Home" => &mut bench,
            "Run" => bench.send(MOVE, 300),
            "Jog" => bench.send(JOG, 300),
            "Hold:0" => bench.send(MOVE, 300).send("!", 50),
            "Door:0" => bench.send(MOVE, 300).bytes(&[0x84], 50),
            "Alarm" => bench.raise(4),
            "Critical" => bench.raise(1),
            "Check" => bench.send("$C\n", 5),
            "Sleep" => bench.send("$SLP\n", 5),
            other => panic!("no way to {other}"),
        };
        bench.firmware.take_outgoing();
        bench
    }

    fn raise(&mut self, code: u32) -> &mut Self {
        self.firmware.raise(code, self.now);
        self.pass(SETTLED_MS)
    }

    fn send(&mut self, text: &str, then_ms: u64) -> &mut Self {
        self.bytes(text.as_bytes(), then_ms)
    }

    fn bytes(&mut self, bytes: &[u8], then_ms: u64) -> &mut Self {
        self.firmware.receive(bytes, self.now);
        self.pass(then_ms)
    }

    fn pass(&mut self, ms: u64) -> &mut Self {
        for _ in 0..=ms {
            self.firmware.advance_time(self.now);
            self.now += Duration::from_millis(1);
        }
        self
    }

    /// The output, without reports and messages.
    fn output(&mut self) -> String {
        let output = String::from_utf8(self.firmware.take_outgoing()).unwrap();
        let word = |line: &str| match line {
            _ if line.starts_with("Grbl") => Some("banner".to_owned()),
            "[MSG:Reset to continue]" => Some("stuck".to_owned()),
            _ if line.is_empty() || line.starts_with(['[', '<', '$']) => None,
            _ => Some(line.replace("error:", "e").replace("ALARM:", "A")),
        };
        output.lines().filter_map(word).collect::<Vec<_>>().join(" ")
    }

    /// The output, and the state after it.
    fn outcome(&mut self) -> String {
        let output = self.output();
        format!("{output} {}", self.firmware.state_text()).trim_start().to_owned()
    }

    fn answers_query(&mut self) -> bool {
        self.firmware.take_outgoing();
        self.send("?", 5);
        String::from_utf8(self.firmware.take_outgoing()).unwrap().contains('<')
    }
}

/// One row: the output of each command and the resulting state.
/// `!`, `~`, 0x18, 0x84, 0x85, `$H`, `$X`, `$J=`, G1, M5.
fn row(dialect: Dialect, state: &str, outcomes: [&str; 10]) {
    let commands: [&[u8]; 10] =
        [b"!", b"~", &[0x18], &[0x84], &[0x85], b"$H\n", b"$X\n", JOG.as_bytes(), b"G1F240X-80\n", b"M5\n"];
    for (command, expected) in commands.iter().zip(outcomes) {
        let mut bench = Bench::in_state(dialect, state);
        bench.bytes(command, SETTLED_MS);
        let command = String::from_utf8_lossy(command).into_owned();
        assert_eq!(bench.outcome(), expected, "{dialect:?} in {state} after {command:?}");
    }
}

#[test]
fn idle() {
    for dialect in Dialect::ALL {
        row(
            dialect,
            "Idle",
            [
                "Hold:0",
                "Idle",
                "banner Idle",
                "Door:0",
                "Idle",
                "ok Idle",
                "ok Idle",
                "ok Jog",
                "ok Run",
                "ok Idle",
            ],
        );
    }
}

#[test]
fn run() {
    for dialect in Dialect::ALL {
        // `M5` waits for the end of the move, which is far away.
        row(
            dialect,
            "Run",
            ["Hold:0", "Run", "A3 banner Alarm", "Door:0", "Run", "e8 Run", "ok Run", "e8 Run", "ok Run", "Run"],
        );
    }
}

#[test]
fn jog() {
    for (dialect, hold) in [(Grbl, "Idle"), (FluidNc, "Idle"), (GrblHal, "Jog")] {
        row(
            dialect,
            "Jog",
            [hold, "Jog", "A3 banner Alarm", "Door:0", "Idle", "e8 Jog", "ok Jog", "ok Jog", "e9 Jog", "e9 Jog"],
        );
    }
}

#[test]
fn hold() {
    for dialect in Dialect::ALL {
        let unread = "Hold:0";
        row(
            dialect,
            "Hold:0",
            ["Hold:0", "Run", "banner Idle", "Door:0", "Hold:0", unread, unread, unread, unread, unread],
        );
    }
}

#[test]
fn home() {
    for (dialect, failed) in
        [(Grbl, "A6 ok banner Alarm"), (GrblHal, "A6 banner Alarm"), (FluidNc, "A6 banner Alarm")]
    {
        let door = failed.replace("A6", "A7");
        let unread = "Home";
        row(dialect, "Home", ["Home", "Home", failed, &door, "Home", unread, unread, unread, unread, unread]);
    }
}

#[test]
fn alarm() {
    for dialect in Dialect::ALL {
        row(
            dialect,
            "Alarm",
            [
                "Alarm",
                "Alarm",
                "banner Alarm",
                "Alarm",
                "Alarm",
                "ok Idle",
                "ok Idle",
                "e8 Alarm",
                "e9 Alarm",
                "e9 Alarm",
            ],
        );
    }
}

#[test]
fn after_a_limit_alarm() {
    let no_response = "Alarm";
    for (dialect, reset, answers) in [
        (Grbl, "banner Alarm", [no_response; 5]),
        (GrblHal, "banner Alarm", ["e79 Alarm", "e79 Alarm", "e79 Alarm", "e9 Alarm", "e9 Alarm"]),
        (FluidNc, "A14 banner Alarm", ["e8 Alarm", "ok Alarm", "e8 Alarm", "e9 Alarm", "e9 Alarm"]),
    ] {
        let [home, unlock, jog, g1, m5] = answers;
        row(
            dialect,
            "Critical",
            [no_response, no_response, reset, no_response, no_response, home, unlock, jog, g1, m5],
        );
    }
}

#[test]
fn door() {
    for dialect in Dialect::ALL {
        let unread = "Door:0";
        row(
            dialect,
            "Door:0",
            [unread, "Run", "banner Idle", unread, unread, unread, unread, unread, unread, unread],
        );
    }
}

#[test]
fn check_and_sleep() {
    for dialect in Dialect::ALL {
        row(
            dialect,
            "Check",
            [
                "Check",
                "Check",
                "banner Idle",
                "Check",
                "Check",
                "e8 Check",
                "ok Check",
                "e8 Check",
                "ok Check",
                "ok Check",
            ],
        );
        let reset = if dialect == FluidNc { "A3 banner Alarm" } else { "banner Alarm" };
        row(
            dialect,
            "Sleep",
            ["Sleep", "Sleep", reset, "Sleep", "Sleep", "Sleep", "Sleep", "Sleep", "Sleep", "Sleep"],
        );
    }
}

#[test]
fn queries_while_homing_and_after_a_limit_alarm_are_answered_as_by_each_firmware() {
    for (dialect, homing, critical) in [(Grbl, false, false), (GrblHal, false, true), (FluidNc, true, true)] {
        assert_eq!(Bench::in_state(dialect, "Home").answers_query(), homing, "{dialect:?} homing");
        assert_eq!(
            Bench::in_state(dialect, "Critical").answers_query(),
            critical,
            "{dialect:?} after a limit alarm"
        );
    }
    let reporting = SimulatorConfig { report_mask: 511 | 1 << 12, ..SimulatorConfig::of(GrblHal) };
    assert!(Bench::configured(reporting, "Home").answers_query());
}

#[test]
fn a_reset_in_the_pause_of_a_limit_alarm_is_lost_except_in_fluid_nc() {
    for (dialect, expected) in
        [(Grbl, "A1 stuck Alarm"), (GrblHal, "A1 stuck Alarm"), (FluidNc, "A1 stuck A14 banner Alarm")]
    {
        let mut bench = Bench::in_state(dialect, "Idle");
        bench.firmware.raise(1, bench.now);
        bench.pass(50).bytes(&[0x18], 2 * SETTLED_MS);
        assert_eq!(bench.outcome(), expected, "{dialect:?}");
    }
}

#[test]
fn nothing_is_sent_in_the_pause_after_an_alarm() {
    for (dialect, pause_ms) in [(Grbl, 500), (GrblHal, 100), (FluidNc, 500)] {
        let mut bench = Bench::in_state(dialect, "Run");
        bench.bytes(&[0x18], pause_ms - 5).send("?", 0);
        assert_eq!(bench.output(), "A3", "{dialect:?}");
        bench.pass(10);
        assert_eq!(bench.output(), "banner", "{dialect:?}");
    }
}

#[test]
fn light_after_alarms_and_holds() {
    // With the laser on, at rest or moving; the event; whether it is on afterwards: GRBL, grblHAL, FluidNC.
    type Act = for<'a> fn(&'a mut Bench) -> &'a mut Bench;
    let cases: [(&str, Act, [bool; 3]); 7] = [
        ("a limit alarm", |bench| bench.raise(1), [false, false, true]),
        ("a failed probe", |bench| bench.raise(4), [true, true, true]),
        ("a hold", |bench| bench.send("!", 50), [false; 3]),
        ("a door", |bench| bench.bytes(&[0x84], 50), [false; 3]),
        ("a door closed again", |bench| bench.bytes(&[0x84], 50).send("~", 200), [true; 3]),
        ("a reset", |bench| bench.bytes(&[0x18], SETTLED_MS), [false; 3]),
        ("G0", |bench| bench.bytes(&[0x18], SETTLED_MS).send("$X\nM3S500\nG0\n", 5), [false; 3]),
    ];
    for (name, act, expected) in cases {
        for (dialect, expected) in Dialect::ALL.into_iter().zip(expected) {
            let mut bench = Bench::in_state(dialect, "Run");
            act(&mut bench);
            assert_eq!(bench.event_log.light(), expected, "{dialect:?} after {name}");
        }
    }
}

#[test]
fn a_reset_during_a_move_turns_the_laser_off_on_fluid_nc_only_after_its_pause() {
    for (dialect, at_once) in [(Grbl, true), (GrblHal, true), (FluidNc, false)] {
        let mut bench = Bench::in_state(dialect, "Run");
        bench.bytes(&[0x18], 10);
        assert_eq!(!bench.event_log.light(), at_once, "{dialect:?}");
    }
}

#[test]
fn a_door_opened_during_a_move_brakes_it_and_persists_while_open() {
    for dialect in Dialect::ALL {
        let slow = SimulatorConfig { acceleration_mm_s2: 20.0, ..SimulatorConfig::of(dialect) };
        let mut bench = Bench::configured(slow, "Idle");
        bench.send(MOVE, 1000).bytes(&[0x84], 20);
        assert_eq!(bench.outcome(), "ok Door:2", "{dialect:?}");
        bench.firmware.trigger_event(Event::DoorOpen(true), bench.now);
        bench.pass(500).send("~", 200);
        assert_eq!(bench.outcome(), "Door:1", "{dialect:?}");
        bench.firmware.trigger_event(Event::DoorOpen(false), bench.now);
        bench.send("~", 10);
        assert_eq!(bench.outcome(), "Door:3", "{dialect:?}");
    }
}

#[test]
fn an_open_door_keeps_it_locked() {
    for dialect in Dialect::ALL {
        let mut bench = Bench::in_state(dialect, "Alarm");
        bench.firmware.trigger_event(Event::DoorOpen(true), bench.now);
        bench.send("$X\n$H\n", SETTLED_MS);
        assert_eq!(bench.outcome(), "e13 e13 Alarm", "{dialect:?}");
    }
}

#[test]
fn a_jog_cancel_drops_unread_lines_of_grbl_hal_only() {
    for (dialect, expected) in [(Grbl, "ok Idle"), (FluidNc, "ok Idle"), (GrblHal, "Idle")] {
        let mut bench = Bench::in_state(dialect, "Hold:0");
        bench.send("M5\n", 5).bytes(&[0x85], 5).bytes(b"~", 20);
        bench.bytes(b"!", 20).bytes(&[0x18], 20);
        // `M5` waited behind the move that continued; the reset dropped it in any case.
        assert_eq!(bench.output(), "banner", "{dialect:?}");
        let mut idle = Bench::in_state(dialect, "Idle");
        idle.firmware.receive(b"M5\n\x85", idle.now);
        idle.pass(20);
        assert_eq!(idle.outcome(), expected, "{dialect:?}");
    }
}

#[test]
fn a_failed_homing_is_reported_as_by_each_firmware() {
    for (dialect, expected) in
        [(Grbl, "A9 ok banner Alarm"), (GrblHal, "A9 banner Alarm"), (FluidNc, "A9 banner Alarm")]
    {
        let broken_switch = SimulatorConfig { switch_works: false, ..SimulatorConfig::of(dialect) };
        let mut bench = Bench::configured(broken_switch, "Idle");
        bench.send("$H\n", 2 * SETTLED_MS);
        assert_eq!(bench.outcome(), expected, "{dialect:?}");
    }
}

#[test]
fn a_homing_lock_is_opened_by_homing_only() {
    let locked = SimulatorConfig { homing_lock: true, ..SimulatorConfig::of(GrblHal) };
    let mut bench = Bench::of(locked);
    assert_eq!(bench.outcome(), "banner A11 Alarm");
    bench.send("$X\n", 5);
    assert_eq!(bench.outcome(), "e46 Alarm");
    bench.send("$H\n", SETTLED_MS);
    assert_eq!(bench.outcome(), "ok Idle");
}

#[test]
fn grbl_hal_ignores_resets_while_its_emergency_stop_is_pressed() {
    let mut bench = Bench::in_state(GrblHal, "Idle");
    bench.firmware.trigger_event(Event::EmergencyStop, bench.now);
    bench.raise(10).bytes(&[0x18], SETTLED_MS);
    assert_eq!(bench.outcome(), "A10 Alarm");
}

#[test]
fn an_acknowledgement_waits_for_dwells_spindles_and_a_full_planner() {
    for (dialect, blocks) in [(Grbl, 15), (GrblHal, 100), (FluidNc, 15)] {
        let slow = SimulatorConfig { spindle_delay: Duration::from_millis(700), ..SimulatorConfig::of(dialect) };
        for line in ["M3S100\n", "G4P0.7\n"] {
            let mut bench = Bench::configured(slow.clone(), "Idle");
            bench.send(line, 600);
            assert_eq!(bench.output(), "", "{dialect:?}: {line} was answered at once");
            assert!(bench.answers_query(), "{dialect:?} does not respond during {line}");
            bench.pass(200);
            assert_eq!(bench.output(), "ok", "{dialect:?}: {line}");
        }
        let mut bench = Bench::in_state(dialect, "Run");
        for _ in 1..blocks + 1 {
            bench.send("G1X-80\n", 2);
        }
        assert_eq!(bench.output().matches("ok").count(), blocks - 1, "{dialect:?}");
    }
}

#[test]
fn input_beyond_the_receive_buffer_is_lost() {
    let mut bench = Bench::in_state(Grbl, "Hold:0");
    bench.send(&"G4P0\n".repeat(40), 5).bytes(b"~", 5).bytes(&[0x18], SETTLED_MS);
    let mut idle = Bench::in_state(Grbl, "Idle");
    idle.firmware.receive("G4P0\n".repeat(40).as_bytes(), idle.now);
    idle.pass(50);
    assert_eq!(idle.output().matches("ok").count(), 128 / 5);
}

#[test]
fn fluid_nc_reports_fewer_settings() {
    let settings = |dialect| {
        let mut bench = Bench::in_state(dialect, "Idle");
        bench.send("$$\n", 5);
        String::from_utf8(bench.firmware.take_outgoing()).unwrap()
    };
    for number in ["$13=", "$27=", "$31="] {
        assert!(settings(Grbl).contains(number) && settings(GrblHal).contains(number));
        assert!(!settings(FluidNc).contains(number), "{number}");
    }
}
