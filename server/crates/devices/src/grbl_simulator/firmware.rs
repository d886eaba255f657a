//! The firmware's side of the dialogue, in its own words and order.
//!
//! Behaviour after GRBL v1.1 (gnea/grbl): `doc/markdown/interface.md` (messages, reports), `laser_mode.md` (light in
//! G1 only, M3 at rest, M4 in motion), `protocol.c` (real-time bytes, holds, alarm lock, order of a pass),
//! `limits.c` (homing answers nothing and ends by a reset, soft limits), `motion_control.c` (`mc_reset`),
//! `gcode.c` (feed rate of G1). Spindle words wait for motions before them (`spindle_control.c`).
//! Simplified: one axis, one motion at a time in the planner, no acceleration changes on the way.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::motion::Motion;
use super::witness::{Happening, Witness};
use super::{Fault, SimulatorConfig};

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    Idle,
    Run,
    Jog,
    /// With the target of the move held back.
    Hold,
    Home,
    Alarm,
    /// After a limit alarm: nothing but a reset is heard.
    Critical,
}

/// A move that was planned.
#[derive(Debug, Clone, Copy)]
struct Planned {
    target_mm: f64,
    speed_mm_s: f64,
}

/// Words that stay until they are replaced.
#[derive(Debug, Clone, Copy)]
struct Modal {
    feeds: bool,
    absolute: bool,
    feed_mm_min: f64,
    spindle: Spindle,
    speed: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Spindle {
    Off,
    Constant,
    Dynamic,
}

const START_MODAL: Modal =
    Modal { feeds: false, absolute: true, feed_mm_min: 0.0, spindle: Spindle::Off, speed: 0.0 };

/// One controller with its machine.
pub struct Firmware {
    config: SimulatorConfig,
    witness: Witness,
    state: State,
    modal: Modal,
    at_mm: f64,
    motion: Option<Motion>,
    planned: Option<Planned>,
    /// Second leg of homing: the pull-off.
    homing_legs: VecDeque<f64>,
    lines: VecDeque<String>,
    incoming: String,
    query: bool,
    lit: Option<f64>,
    reports: usize,
    /// What a fault asked for takes effect.
    pub fault: Option<Fault>,
    outgoing: Vec<u8>,
}

impl Firmware {
    /// A controller just powered on.
    pub fn new(config: SimulatorConfig, witness: Witness, now: Instant) -> Self {
        let mut firmware = Self {
            at_mm: config.start_at_mm,
            config,
            witness,
            state: State::Idle,
            modal: START_MODAL,
            motion: None,
            planned: None,
            homing_legs: VecDeque::new(),
            lines: VecDeque::new(),
            incoming: String::new(),
            query: false,
            lit: None,
            reports: 0,
            fault: None,
            outgoing: Vec::new(),
        };
        firmware.witness.saw(now, Happening::PoweredOn);
        firmware.boot(now);
        firmware
    }

    /// What is to be sent to the computer, handed out once.
    pub fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    /// Whether anything goes on that time changes.
    pub fn busy(&self) -> bool {
        self.motion.is_some() || !self.lines.is_empty() || self.query
    }

    /// Switched off and on again, wherever it was: the machine stands, the laser is dark, the banner comes.
    pub fn power_cycle(&mut self, now: Instant) {
        self.halt(now);
        self.state = State::Idle;
        self.witness.saw(now, Happening::PoweredOn);
        self.boot(now);
    }

    /// The power goes: nothing moves or shines.
    pub fn power_off(&mut self, now: Instant) {
        self.halt(now);
        self.modal = START_MODAL;
        self.update_light(now);
    }

    /// An alarm by itself, as from a limit switch.
    pub fn raise(&mut self, code: u32, now: Instant) {
        self.halt(now);
        self.modal.spindle = Spindle::Off;
        self.update_light(now);
        self.alarm(code);
        if (3..=9).contains(&code) {
            self.state = State::Alarm;
            self.banner();
        } else {
            self.say("[MSG:Reset to continue]");
            self.state = State::Critical;
        }
    }

    /// Light that nobody asked for, as from a shorted output.
    pub fn shine_unasked(&mut self, now: Instant) {
        self.modal =
            Modal { spindle: Spindle::Constant, speed: self.config.max_spindle, feeds: true, ..self.modal };
        self.update_light(now);
    }

    /// The axis stops on its way while the firmware goes on counting on it.
    pub fn stall(&mut self, now: Instant) {
        if let Some(motion) = self.motion {
            self.at_mm = motion.at(now).0;
        }
    }

    /// Bytes from the computer.
    pub fn hear(&mut self, bytes: &[u8], now: Instant) {
        for &byte in bytes {
            self.witness.saw(now, Happening::Byte(byte));
            match byte {
                0x18 => self.reset(now),
                b'?' => self.query = true,
                b'!' => self.hold(now),
                b'~' => self.resume(now),
                0x85 => self.cancel_jog(now),
                0x80.. => {}
                b'\n' | b'\r' => {
                    let line = std::mem::take(&mut self.incoming);
                    self.lines.push_back(line);
                }
                _ if byte > b' ' => self.incoming.push(char::from(byte.to_ascii_uppercase())),
                _ => {}
            }
        }
    }

    /// Lets time pass up to `now`.
    pub fn pass(&mut self, now: Instant) {
        self.advance(now);
        while self.listens() {
            let Some(line) = self.lines.pop_front() else { break };
            if self.must_wait(&line) {
                self.lines.push_front(line);
                break;
            }
            self.execute(&line, now);
        }
        // `limits.c` has no time for reports while homing; grblHAL has.
        let deaf = self.state == State::Critical || (self.state == State::Home && !self.config.grbl_hal);
        if self.query && !deaf {
            self.query = false;
            self.report(now);
        }
        self.update_light(now);
    }

    fn listens(&self) -> bool {
        !matches!(self.state, State::Home | State::Critical | State::Hold)
    }

    /// Spindle words wait for the end of motions (buffer synchronisation); so do further moves here.
    fn must_wait(&self, line: &str) -> bool {
        let moving = matches!(self.state, State::Run | State::Jog);
        moving && !line.starts_with('$') && self.state != State::Jog
    }

    fn advance(&mut self, now: Instant) {
        let Some(motion) = self.motion else { return };
        if self.fault == Some(Fault::Stall) {
            return;
        }
        if now < motion.ends_at() {
            self.at_mm = motion.at(now).0;
            return;
        }
        let ended_at = motion.ends_at();
        self.at_mm = self.snapped(motion.at(ended_at).0);
        self.motion = None;
        self.witness.saw(ended_at, Happening::MotionEnded(self.at_mm));
        match self.state {
            State::Home => self.homing_leg_ended(now),
            State::Run | State::Jog => {
                self.state = State::Idle;
                self.planned = None;
            }
            State::Idle | State::Hold | State::Alarm | State::Critical => {}
        }
    }

    fn snapped(&self, at_mm: f64) -> f64 {
        (at_mm * self.config.steps_per_mm).round() / self.config.steps_per_mm
    }

    /// Machine space ends at 0, the switch, which is found at `switch_at` by the machine's own frame.
    fn home(&mut self, now: Instant) {
        if !self.config.homing {
            return self.say("error:5");
        }
        self.state = State::Home;
        // The axis does not know where it is; how far the switch really is, only the simulation knows.
        self.homing_legs = VecDeque::from([0.0, -self.config.pull_off_mm]);
        self.homing_leg_ended(now);
    }

    fn homing_leg_ended(&mut self, now: Instant) {
        match self.homing_legs.pop_front() {
            Some(to_mm) => self.begin(to_mm, self.config.homing_mm_s, now),
            None => {
                self.state = State::Idle;
                self.say("ok");
            }
        }
    }

    fn begin(&mut self, to_mm: f64, speed_mm_s: f64, now: Instant) {
        self.witness.saw(now, Happening::MotionBegan(self.at_mm));
        self.motion = Some(Motion::travel(self.at_mm, to_mm, speed_mm_s, self.config.acceleration_mm_s2, now));
    }

    /// Stops dead, as `st_go_idle` does.
    fn halt(&mut self, now: Instant) {
        if let Some(motion) = self.motion.take() {
            if self.fault != Some(Fault::Stall) {
                self.at_mm = self.snapped(motion.at(now).0);
            }
            self.witness.saw(now, Happening::MotionEnded(self.at_mm));
        }
        self.planned = None;
        self.homing_legs.clear();
        self.lines.clear();
        self.incoming.clear();
        self.query = false;
    }

    /// `mc_reset` and what the main program does after it.
    fn reset(&mut self, now: Instant) {
        self.advance(now);
        let moving = self.motion.is_some();
        let homing = self.state == State::Home;
        let locked = matches!(self.state, State::Alarm | State::Critical);
        self.halt(now);
        self.modal = START_MODAL;
        self.update_light(now);
        self.state = if locked || moving || homing { State::Alarm } else { State::Idle };
        if homing {
            self.alarm(6);
        } else if moving {
            self.alarm(3);
        }
        self.banner();
    }

    fn boot(&mut self, now: Instant) {
        self.modal = START_MODAL;
        self.update_light(now);
        if self.config.homing {
            self.state = State::Alarm;
        }
        self.banner();
    }

    fn banner(&mut self) {
        let banner = self.config.banner.clone();
        self.say("");
        self.say(&banner);
        if self.state == State::Alarm {
            self.say("[MSG:'$H'|'$X' to unlock]");
        }
        self.reports = 0;
    }

    fn alarm(&mut self, code: u32) {
        self.say(&format!("ALARM:{code}"));
    }

    fn hold(&mut self, now: Instant) {
        self.advance(now);
        match self.state {
            State::Run | State::Jog => {
                if let Some(motion) = &mut self.motion {
                    *motion = motion.braking(now);
                }
                // A hold ends a jog; a move waits.
                if self.state == State::Run {
                    self.state = State::Hold;
                }
            }
            State::Idle => self.state = State::Hold,
            State::Hold | State::Home | State::Alarm | State::Critical => {}
        }
    }

    fn resume(&mut self, now: Instant) {
        if self.state != State::Hold || self.motion.is_some() {
            return;
        }
        match self.planned {
            Some(planned) => {
                self.state = State::Run;
                self.begin(planned.target_mm, planned.speed_mm_s, now);
            }
            None => self.state = State::Idle,
        }
    }

    fn cancel_jog(&mut self, now: Instant) {
        if self.state == State::Jog {
            self.hold(now);
        }
    }

    fn execute(&mut self, line: &str, now: Instant) {
        let idle = matches!(self.state, State::Idle | State::Alarm);
        match line {
            "" => self.say("ok"),
            "$X" => {
                if self.state == State::Alarm {
                    self.say("[MSG:Caution: Unlocked]");
                    self.state = State::Idle;
                }
                self.say("ok");
            }
            "$I" | "$$" | "$H" if !idle => self.say("error:8"),
            "$I" => self.tell_build(),
            "$$" => self.tell_settings(),
            "$H" => self.home(now),
            _ => match line.strip_prefix("$J=") {
                Some(words) => self.jog(words, now),
                None if line.starts_with('$') => self.say("error:3"),
                None if matches!(self.state, State::Alarm | State::Jog) => self.say("error:9"),
                None => self.block(line, now),
            },
        }
    }

    fn jog(&mut self, words: &str, now: Instant) {
        if !matches!(self.state, State::Idle | State::Jog) {
            return self.say("error:8");
        }
        let Some(words) = words_of(words) else { return self.say("error:2") };
        let absolute = !words.contains(&('G', 91.0));
        let (Some(axis_mm), Some(feed_mm_min)) = (value(&words, self.config.axis), value(&words, 'F')) else {
            return self.say("error:22");
        };
        let target_mm = if absolute { axis_mm } else { self.at_mm + axis_mm };
        if self.config.soft_limits && !self.within(target_mm) {
            return self.say("error:15");
        }
        self.state = State::Jog;
        self.begin(target_mm, self.limited(feed_mm_min), now);
        self.say("ok");
    }

    /// One line of G-code: the words this machine needs, and error 20 for others.
    fn block(&mut self, line: &str, now: Instant) {
        let Some(words) = words_of(line) else { return self.say("error:2") };
        let mut modal = self.modal;
        let (mut names_g1, mut machine_space) = (false, false);
        for &(letter, number) in &words {
            match (letter, number) {
                ('G', 0.0) => modal.feeds = false,
                ('G', 1.0) => (modal.feeds, names_g1) = (true, true),
                ('G', 53.0) => machine_space = true,
                ('G', 90.0) => modal.absolute = true,
                ('G', 91.0) => modal.absolute = false,
                ('G', 21.0 | 94.0) => {}
                ('M', 3.0) => modal.spindle = Spindle::Constant,
                ('M', 4.0) => modal.spindle = Spindle::Dynamic,
                ('M', 5.0) => modal.spindle = Spindle::Off,
                ('F', feed) => modal.feed_mm_min = feed,
                ('S', speed) => modal.speed = speed.min(self.config.max_spindle),
                (letter, _) if letter == self.config.axis => {}
                _ => return self.say("error:20"),
            }
        }
        let axis = value(&words, self.config.axis);
        let feeding = names_g1 || (modal.feeds && axis.is_some());
        if feeding && modal.feed_mm_min == 0.0 {
            return self.say("error:22");
        }
        let target_mm =
            axis.map(|axis_mm| if modal.absolute || machine_space { axis_mm } else { self.at_mm + axis_mm });
        self.modal = modal;
        self.update_light(now);
        match target_mm {
            Some(target_mm) if self.config.soft_limits && !self.within(target_mm) => self.raise(2, now),
            Some(target_mm) => {
                let speed_mm_s = self.limited(self.modal.feed_mm_min);
                self.planned = Some(Planned { target_mm, speed_mm_s });
                self.state = State::Run;
                self.begin(target_mm, speed_mm_s, now);
                self.say("ok");
            }
            None => self.say("ok"),
        }
    }

    fn within(&self, machine_mm: f64) -> bool {
        (-self.config.max_travel_mm..=0.0).contains(&machine_mm)
    }

    fn limited(&self, feed_mm_min: f64) -> f64 {
        (feed_mm_min / 60.0).min(self.config.max_speed_mm_s)
    }

    /// Light as `laser_mode.md` says: in G1 only, M3 also at rest, M4 in motion, none in a hold once at rest.
    fn update_light(&mut self, now: Instant) {
        let moving = self.motion.is_some();
        let held = self.state == State::Hold && !moving;
        let gives_out = match self.modal.spindle {
            Spindle::Off => false,
            Spindle::Constant => self.modal.feeds && !held,
            Spindle::Dynamic => self.modal.feeds && moving,
        };
        let lit = (gives_out && self.modal.speed > 0.0).then(|| self.modal.speed / self.config.max_spindle);
        if lit == self.lit {
            return;
        }
        self.lit = lit;
        self.witness.saw(now, lit.map_or(Happening::LightOff, Happening::LightOn));
    }

    fn report(&mut self, now: Instant) {
        let state = match self.state {
            State::Idle => "Idle",
            State::Run => "Run",
            State::Jog => "Jog",
            State::Hold if self.motion.is_some() => "Hold:1",
            State::Hold => "Hold:0",
            State::Home => "Home",
            State::Alarm | State::Critical => "Alarm",
        };
        let mut axes_mm = [0.0; 3];
        axes_mm[self.config.axis_idx()] = self.snapped(self.at_mm);
        let [x, y, z] = axes_mm;
        let feed_mm_min = self.motion.map_or(0.0, |motion| motion.at(now).1 * 60.0);
        let speed = if self.modal.spindle == Spindle::Off { 0.0 } else { self.modal.speed };
        let offset = if self.reports.is_multiple_of(30) { "|WCO:0.000,0.000,0.000" } else { "" };
        self.reports += 1;
        self.say(&format!("<{state}|MPos:{x:.3},{y:.3},{z:.3}|FS:{feed_mm_min:.0},{speed:.0}{offset}>"));
    }

    fn tell_build(&mut self) {
        let name = self.config.name.clone();
        self.say(&format!("[VER:1.1h.20190825:{name}]"));
        self.say("[OPT:V,15,128]");
        if self.config.grbl_hal {
            self.say("[FIRMWARE:grblHAL]");
        }
        self.say("ok");
    }

    fn tell_settings(&mut self) {
        let config = &self.config;
        let flag = |on: bool| if on { 1.0 } else { 0.0 };
        let mut settings = vec![
            (10, 1.0),
            (13, flag(config.inches)),
            (20, flag(config.soft_limits)),
            (22, flag(config.homing)),
            (27, config.pull_off_mm),
            (30, config.max_spindle),
            (31, 0.0),
            (32, flag(config.laser_mode)),
        ];
        for axis in 0..3 {
            settings.push((100 + axis, config.steps_per_mm));
            settings.push((110 + axis, config.max_speed_mm_s * 60.0));
            settings.push((120 + axis, config.acceleration_mm_s2));
            settings.push((130 + axis, config.max_travel_mm));
        }
        settings.sort_by_key(|(number, _)| *number);
        for (number, value) in settings {
            self.say(&format!("${number}={value:.3}"));
        }
        self.say("ok");
    }

    fn say(&mut self, line: &str) {
        self.outgoing.extend_from_slice(line.as_bytes());
        self.outgoing.extend_from_slice(b"\r\n");
    }
}

/// Letters and numbers of a line; `None` if it is not made of them.
fn words_of(line: &str) -> Option<Vec<(char, f64)>> {
    let mut words = Vec::new();
    let mut rest = line;
    while let Some(letter) = rest.chars().next() {
        let tail = rest.get(1..)?;
        let length = tail.find(|c: char| c.is_ascii_uppercase()).unwrap_or(tail.len());
        words.push((letter, tail[..length].parse().ok()?));
        rest = &tail[length..];
    }
    Some(words)
}

fn value(words: &[(char, f64)], letter: char) -> Option<f64> {
    words.iter().find(|(of, _)| *of == letter).map(|(_, number)| *number)
}

/// Longest sleep of the simulation while something goes on.
pub const BUSY_PERIOD: Duration = Duration::from_millis(1);
