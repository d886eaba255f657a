//! A controller with Marlin, one axis and a laser, simulated in real time behind a pseudo-terminal.
//!
//! Written from marlinfw.org (G-code reference: M3, M5, M84, M92, M110, M112–M115, M201–M204, M206, M211, M400, M410,
//! M503, G28) and from the order and timing in `queue.cpp`, `e_parser.h`, `M3-M5.cpp` and `motion.cpp` of
//! MarlinFirmware/Marlin 2.x; it shares no code with the driver. Simulated quirks: `start` and echo lines at power-on;
//! `ok` means planned, not moved; the first block waits 0.1 s for more; line numbers, `Resend` with or without a
//! following `ok`; unknown commands are echoed and acknowledged; soft endstops silently limit targets; while a command
//! waits only the emergency parser takes input, and `echo:busy` is sent; M410 drops everything received in the next
//! second; M112 halts permanently; the laser's safety timeout.

mod commands;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::simulators::simulator::{EventLog, Firmware, LogEvent, SimulatedAxis, Simulator};

/// The simulated machine. Positions are on its own scale, mm from its switch.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatorConfig {
    /// `MACHINE_TYPE` of M115.
    pub name: String,
    /// Letter of the axis.
    pub axis: char,
    /// `M92`.
    pub steps_per_mm: f64,
    /// `M203`, mm/s.
    pub max_speed_mm_s: f64,
    /// `M201`, mm/s².
    pub acceleration_mm_s2: f64,
    /// Upper soft endstop, mm; the lower is 0.
    pub max_travel_mm: f64,
    /// Speed of homing, mm/s.
    pub homing_mm_s: f64,
    /// `Cap:EMERGENCY_PARSER`.
    pub emergency_parser: bool,
    /// `LASER_FEATURE`.
    pub laser: bool,
    /// `LASER_SAFETY_TIMEOUT_MS`; 0: none.
    pub laser_timeout_ms: u64,
    /// `ADVANCED_OK`.
    pub advanced_ok: bool,
    /// Whether `ok` follows `Resend`, as in 1.x and early 2.0.
    pub ok_after_resend: bool,
    /// Time from power-on to `start`.
    pub boot: Duration,
    /// Position of the axis at the first power-on, mm.
    pub start_at_mm: f64,
}

impl Default for SimulatorConfig {
    /// 100 mm of travel, 200 mm/s, 3 m/s², 80 steps/mm, with a laser.
    fn default() -> Self {
        Self {
            name: "Simulated stage".to_owned(),
            axis: 'X',
            steps_per_mm: 80.0,
            max_speed_mm_s: 200.0,
            acceleration_mm_s2: 3000.0,
            max_travel_mm: 100.0,
            homing_mm_s: 150.0,
            emergency_parser: true,
            laser: true,
            laser_timeout_ms: 1000,
            advanced_ok: false,
            ok_after_resend: false,
            boot: Duration::from_millis(50),
            start_at_mm: 7.0,
        }
    }
}

/// Events of this controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// Its reset button is pressed: it restarts.
    ResetButton,
    /// An endstop is hit during a move, which it reports.
    EndstopHit,
    /// The axis is blocked: its steps are not executed, and it waits for them.
    Stuck,
    /// The axis is free again.
    Repair,
    /// It halts itself.
    Kill,
    /// The next line is received damaged.
    DamageNextLine,
    /// It acknowledges no line until it is repaired.
    NoAcknowledgement,
}

/// A simulated controller behind a pseudo-terminal.
pub type MarlinSimulator = Simulator<MarlinFirmware>;

/// Size of its line buffer (`BUFSIZE`).
const N_LINES: usize = 4;
/// Size of its planner queue (`BLOCK_BUFFER_SIZE`).
const N_BLOCKS: usize = 16;
/// How long the first block waits for more (`BLOCK_DELAY_FOR_1ST_MOVE`).
const FIRST_BLOCK_DELAY: Duration = Duration::from_millis(100);
/// How long moves are dropped after M410.
const QUICK_STOP_DROP_TIME: Duration = Duration::from_secs(1);

/// What a command waits for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Waiting {
    /// The planner is empty; then this.
    Synchronized(Then),
    /// The axis is homed.
    Homed,
    /// Room in the planner.
    Room { target_mm: f64, speed_mm_s: f64 },
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Then {
    Answer,
    LaserOn(f64),
    LaserOff,
    Home,
}

/// See the module.
pub struct MarlinFirmware {
    config: SimulatorConfig,
    event_log: EventLog,
    axis: SimulatedAxis,
    outgoing: Vec<u8>,
    starts_at: Option<Instant>,
    running: bool,
    halted: bool,
    line: Vec<u8>,
    /// Bytes not read yet.
    rx: VecDeque<u8>,
    lines: VecDeque<String>,
    last_number: i64,
    waiting: Option<Waiting>,
    busy_sent_at: Instant,
    keepalive: Duration,
    /// Ends and speeds of planned moves.
    blocks: VecDeque<(f64, f64)>,
    first_block_at: Option<Instant>,
    /// End of the last planned move: the `X:` of M114.
    planned_mm: f64,
    /// True position of its zero.
    origin_mm: f64,
    speed_mm_s: f64,
    dropping_until: Option<Instant>,
    light: Option<f64>,
    last_move_at: Instant,
    emergency: Vec<u8>,
    damage_next: bool,
    is_silent: bool,
}

impl Firmware for MarlinFirmware {
    type Config = SimulatorConfig;
    type Event = Event;

    fn new(config: SimulatorConfig, event_log: EventLog) -> Self {
        let now = Instant::now();
        Self {
            axis: SimulatedAxis::new(config.start_at_mm, config.acceleration_mm_s2, event_log.clone()),
            planned_mm: 0.0,
            origin_mm: config.start_at_mm,
            config,
            event_log,
            outgoing: Vec::new(),
            starts_at: None,
            running: false,
            halted: false,
            line: Vec::new(),
            rx: VecDeque::new(),
            lines: VecDeque::new(),
            last_number: 0,
            waiting: None,
            busy_sent_at: now,
            keepalive: Duration::from_secs(2),
            blocks: VecDeque::new(),
            first_block_at: None,
            speed_mm_s: 10.0,
            dropping_until: None,
            light: None,
            last_move_at: now,
            emergency: Vec::new(),
            damage_next: false,
            is_silent: false,
        }
    }

    fn power_on(&mut self, now: Instant) {
        self.starts_at = Some(now + self.config.boot);
    }

    fn power_off(&mut self, now: Instant) {
        self.turn_laser_off(now);
        self.axis.halt(now);
        self.rx.clear();
        self.lines.clear();
        self.line.clear();
        self.blocks.clear();
        self.outgoing.clear();
        (self.waiting, self.first_block_at, self.dropping_until, self.starts_at) = (None, None, None, None);
        (self.running, self.halted, self.is_silent, self.last_number) = (false, false, false, 0);
        self.keepalive = Duration::from_secs(2);
        // The firmware takes the position at start-up as zero.
        (self.planned_mm, self.origin_mm) = (0.0, self.axis.at_mm);
    }

    fn receive(&mut self, bytes: &[u8], now: Instant) {
        if !self.running || self.halted {
            return;
        }
        for &byte in bytes {
            self.rx.push_back(byte);
            if self.config.emergency_parser {
                self.parse_early(byte, now);
            }
        }
    }

    fn advance_time(&mut self, now: Instant) {
        if self.starts_at.is_some_and(|at| now >= at) {
            self.starts_at = None;
            self.running = true;
            for line in ["start", "echo:Marlin 2.1.2.4", "echo: Last Updated: 2024-01-01 | Author: (none)"] {
                self.send_line(line);
            }
            self.send_line("echo: Free Memory: 3735  PlannerBufferBytes: 1200");
        }
        if !self.running || self.halted {
            return;
        }
        self.read_lines();
        self.axis.advance_time(now);
        self.advance(now);
        self.work(now);
        if self.axis.moving() {
            self.last_move_at = now;
        }
        let timeout = Duration::from_millis(self.config.laser_timeout_ms);
        if self.light.is_some() && !timeout.is_zero() && now - self.last_move_at > timeout {
            self.turn_laser_off(now);
        }
    }

    fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    fn trigger_event(&mut self, event: Event, now: Instant) {
        match event {
            Event::ResetButton => {
                self.power_off(now);
                self.power_on(now);
            }
            Event::EndstopHit => {
                self.axis.halt(now);
                self.blocks.clear();
                self.planned_mm = self.axis.at_mm - self.origin_mm;
                self.send_line(&format!("echo:endstops hit:  {}:{:.2}", self.config.axis, self.axis.at_mm));
            }
            Event::Stuck => self.axis.stuck = true,
            Event::Repair => (self.axis.stuck, self.is_silent) = (false, false),
            Event::Kill => self.kill(now),
            Event::DamageNextLine => self.damage_next = true,
            Event::NoAcknowledgement => self.is_silent = true,
        }
    }
}

impl MarlinFirmware {
    /// Detects M112 and M410 at the beginning of a line, byte by byte, during any other activity.
    fn parse_early(&mut self, byte: u8, now: Instant) {
        if byte != b'\n' && byte != b'\r' {
            self.emergency.push(byte);
            return;
        }
        let line = String::from_utf8_lossy(&std::mem::take(&mut self.emergency)).into_owned();
        match command_of(&line) {
            "M112" => self.kill(now),
            "M410" => self.quick_stop(now),
            _ => {}
        }
    }

    fn kill(&mut self, now: Instant) {
        self.turn_laser_off(now);
        self.axis.halt(now);
        self.blocks.clear();
        self.send_line("Error:Printer halted. kill() called!");
        self.halted = true;
    }

    /// Stops abruptly; the position is that of the steps.
    fn quick_stop(&mut self, now: Instant) {
        self.axis.halt(now);
        self.blocks.clear();
        self.first_block_at = None;
        self.planned_mm = self.axis.at_mm - self.origin_mm;
        self.dropping_until = Some(now + QUICK_STOP_DROP_TIME);
    }

    fn turn_laser_off(&mut self, now: Instant) {
        if self.light.take().is_some() {
            self.event_log.record(now, LogEvent::LightOff);
        }
    }

    fn send_line(&mut self, line: &str) {
        self.outgoing.extend_from_slice(line.as_bytes());
        self.outgoing.push(b'\n');
    }

    fn ok(&mut self) {
        if self.is_silent {
            return;
        }
        let free = N_BLOCKS - 1 - self.blocks.len().min(N_BLOCKS - 1);
        let more = if self.config.advanced_ok {
            format!(" N{} P{free} B{}", self.last_number, N_LINES - 1)
        } else {
            String::new()
        };
        self.send_line(&format!("ok{more}"));
    }

    /// Reads lines while there is room for them.
    fn read_lines(&mut self) {
        while self.lines.len() < N_LINES {
            let Some(byte) = self.rx.pop_front() else { return };
            if byte != b'\n' && byte != b'\r' {
                self.line.push(byte);
                continue;
            }
            let mut line = String::from_utf8_lossy(&std::mem::take(&mut self.line)).trim().to_owned();
            if line.is_empty() {
                continue;
            }
            if std::mem::take(&mut self.damage_next) {
                line.insert(line.len() / 2, '?');
            }
            if let Some(accepted) = self.checked(&line) {
                self.lines.push_back(accepted);
            }
        }
    }

    /// The command without its number and checksum; `None` if a resend is requested.
    fn checked(&mut self, line: &str) -> Option<String> {
        let Some(numbered) = line.strip_prefix('N') else { return Some(line.to_owned()) };
        let digits = numbered.len() - numbered.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let number: i64 = numbered[..digits].parse().unwrap_or(-1);
        let command = numbered[digits..].split('*').next().unwrap_or_default().trim().to_owned();
        let renumbers = command.starts_with("M110");
        if number != self.last_number + 1 && !renumbers {
            return self.request_resend("Line Number is not Last Line Number+1");
        }
        let Some((before, sum)) = line.rsplit_once('*') else {
            return self.request_resend("No Checksum with line number");
        };
        let xor = before.bytes().fold(0_u8, |sum, byte| sum ^ byte);
        if sum.trim().parse::<u8>() != Ok(xor) {
            return self.request_resend("checksum mismatch");
        }
        self.last_number = if renumbers {
            command.split('N').nth(1).and_then(|number| number.trim().parse().ok()).unwrap_or(number)
        } else {
            number
        };
        Some(command)
    }

    fn request_resend(&mut self, why: &str) -> Option<String> {
        self.send_line(&format!("Error:{why}, Last Line: {}", self.last_number));
        self.rx.clear();
        self.line.clear();
        self.send_line(&format!("Resend: {}", self.last_number + 1));
        if self.config.ok_after_resend {
            self.send_line("ok");
        }
        None
    }

    /// Advances from planned move to planned move.
    fn advance(&mut self, now: Instant) {
        if self.dropping_until.is_some_and(|until| now >= until) {
            self.dropping_until = None;
        }
        while self.blocks.len() > 1 && self.has_passed() {
            self.blocks.pop_front();
        }
        if self.blocks.len() == 1 && !self.axis.moving() && self.axis.at_mm == self.blocks[0].0 {
            self.blocks.pop_front();
            self.first_block_at = None;
        }
        let Some(&(first_mm, speed_mm_s)) = self.blocks.front() else { return };
        if !self.axis.moving() && self.first_block_at.is_some_and(|at| now - at < FIRST_BLOCK_DELAY) {
            return;
        }
        // Consecutive moves in the same direction are one for the motor.
        let direction = (first_mm - self.axis.at_mm).signum();
        let mut target_mm = first_mm;
        for &(next_mm, _) in self.blocks.iter().skip(1) {
            if (next_mm - target_mm) * direction < 0.0 {
                break;
            }
            target_mm = next_mm;
        }
        self.axis.go(target_mm, speed_mm_s, now);
    }

    fn has_passed(&self) -> bool {
        let (first_mm, next_mm) = (self.blocks[0].0, self.blocks[1].0);
        let direction = (next_mm - first_mm).signum();
        (self.axis.at_mm - first_mm) * direction >= 0.0
    }
}

/// The command word of a line, with or without a line number.
fn command_of(line: &str) -> &str {
    let line = line.trim();
    let line = line
        .strip_prefix('N')
        .map_or(line, |rest| rest.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start());
    line.split([' ', '*']).next().unwrap_or_default()
}
