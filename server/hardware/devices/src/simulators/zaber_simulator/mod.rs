//! A device with Zaber's ASCII protocol and one axis, simulated in real time behind a pseudo-terminal.
//!
//! Written from Zaber's "ASCII Protocol Manual" (firmware 7: message format, checksums, continuations, alerts, warning
//! flags, reasons); it shares no code with the driver. Simulated quirks: a damaged command is rejected as `BADMESSAGE`
//! or, without an address, not answered; answers come at once whatever the axis does; only the flag of highest priority
//! is shown; `FS` persists until it is cleared or the axis moves; `WR` after power-on; alerts at the end of a motion
//! (`comm.alert`); long answers continue in a second line; an info line may come in between.

use std::time::Instant;

use crate::simulators::simulator::{EventLog, Firmware, SimulatedAxis, Simulator};

/// The simulated device. Positions are on its own scale, mm from its home.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatorConfig {
    /// Its address in the chain.
    pub address: u8,
    /// Number of axes; the first one moves.
    pub n_axes: u8,
    /// `device.id`.
    pub device_id: u32,
    /// `system.serial`.
    pub serial: u32,
    /// `version`; from 7.25 on `move abs` accepts a speed.
    pub version: f64,
    /// `resolution`.
    pub resolution: f64,
    /// Travel in one turn of the motor, mm.
    pub travel_per_turn_mm: f64,
    /// End of the travel, mm; it begins at 0.
    pub max_travel_mm: f64,
    /// Fastest, mm/s.
    pub max_speed_mm_s: f64,
    /// Acceleration, mm/s².
    pub acceleration_mm_s2: f64,
    /// Speed of homing, mm/s.
    pub homing_mm_s: f64,
    /// `comm.checksum` at power-on.
    pub checksums: bool,
    /// `comm.alert`.
    pub alerts: bool,
    /// Position of the axis at the first power-on.
    pub start_at_mm: f64,
}

impl Default for SimulatorConfig {
    /// 100 mm of travel, 200 mm/s, 5 m/s², firmware 7.
    fn default() -> Self {
        Self {
            address: 1,
            n_axes: 1,
            device_id: 50_422,
            serial: 80_001,
            version: 7.38,
            resolution: 64.0,
            travel_per_turn_mm: 2.0,
            max_travel_mm: 100.0,
            max_speed_mm_s: 200.0,
            acceleration_mm_s2: 5000.0,
            homing_mm_s: 150.0,
            checksums: false,
            alerts: true,
            start_at_mm: 7.0,
        }
    }
}

/// Events of this device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// The axis is blocked: it stalls, and the firmware detects it (`FS`).
    Stall,
    /// The axis is blocked, and the firmware does not detect it.
    StuckUndetected,
    /// The emergency stop is pressed (`FH`).
    EmergencyStop,
    /// The emergency stop is released, the axis free again.
    Repair,
    /// The knob is turned: the motion ends.
    Knob,
    /// The axis is pushed at rest (`WM`).
    Push,
}

/// A simulated device behind a pseudo-terminal.
pub type ZaberSimulator = Simulator<ZaberFirmware>;

/// Steps per turn of the motor.
const STEPS_PER_TURN: f64 = 200.0;
/// Data for a speed of one microstep/s.
const SPEED_DATA: f64 = 1.6384;
/// Data for an acceleration of one microstep/s².
const ACCELERATION_DATA: f64 = 1.6384e-4;
/// Longest line; the rest is sent in another.
const LINE_BYTES: usize = 80;

/// See the module.
pub struct ZaberFirmware {
    config: SimulatorConfig,
    axis: SimulatedAxis,
    powered: bool,
    received: Vec<u8>,
    outgoing: Vec<u8>,
    checksums: bool,
    homing: bool,
    referenced: bool,
    stalled: bool,
    emergency: bool,
    displaced: bool,
    interrupted: bool,
    max_speed_mm_s: f64,
    was_moving: bool,
    n_replies: u32,
}

impl Firmware for ZaberFirmware {
    type Config = SimulatorConfig;
    type Event = Event;

    fn new(config: SimulatorConfig, event_log: EventLog) -> Self {
        Self {
            axis: SimulatedAxis::new(config.start_at_mm, config.acceleration_mm_s2, event_log),
            checksums: config.checksums,
            max_speed_mm_s: config.max_speed_mm_s,
            config,
            powered: false,
            received: Vec::new(),
            outgoing: Vec::new(),
            homing: false,
            referenced: false,
            stalled: false,
            emergency: false,
            displaced: false,
            interrupted: false,
            was_moving: false,
            n_replies: 0,
        }
    }

    /// Settings are kept; the reference is not.
    fn power_on(&mut self, _now: Instant) {
        (self.powered, self.referenced) = (true, false);
    }

    fn power_off(&mut self, now: Instant) {
        self.axis.halt(now);
        self.received.clear();
        self.outgoing.clear();
        (self.powered, self.homing, self.stalled, self.displaced, self.interrupted, self.was_moving) =
            (false, false, false, false, false, false);
    }

    fn receive(&mut self, bytes: &[u8], now: Instant) {
        for &byte in bytes {
            if byte == b'\n' || byte == b'\r' {
                let line = String::from_utf8_lossy(&std::mem::take(&mut self.received)).into_owned();
                self.line(&line, now);
            } else {
                self.received.push(byte);
            }
        }
    }

    fn advance_time(&mut self, now: Instant) {
        self.axis.advance_time(now);
        if self.homing && !self.axis.moving() {
            (self.homing, self.referenced) = (false, true);
        }
        if self.was_moving && !self.axis.moving() && self.config.alerts {
            self.send_line(&format!("!{:02} 1 IDLE {}", self.config.address, self.flag()));
        }
        self.was_moving = self.axis.moving();
    }

    fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    fn trigger_event(&mut self, event: Event, now: Instant) {
        match event {
            Event::Stall => {
                if self.axis.moving() {
                    self.axis.halt(now);
                }
                (self.stalled, self.homing) = (true, false);
            }
            Event::StuckUndetected => self.axis.stuck = true,
            Event::EmergencyStop => {
                self.axis.halt(now);
                (self.emergency, self.homing) = (true, false);
            }
            Event::Repair => {
                (self.emergency, self.axis.stuck) = (false, false);
            }
            Event::Knob => {
                self.axis.halt(now);
                (self.interrupted, self.homing) = (true, false);
            }
            Event::Push => {
                self.axis.at_mm += 1.0;
                self.displaced = true;
            }
        }
    }
}

impl ZaberFirmware {
    fn steps_per_mm(&self) -> f64 {
        self.config.resolution * STEPS_PER_TURN / self.config.travel_per_turn_mm
    }

    /// The flag of highest priority.
    fn flag(&self) -> &'static str {
        match () {
            () if self.emergency => "FH",
            () if self.stalled => "FS",
            () if self.displaced => "WM",
            () if !self.referenced => "WR",
            () if self.interrupted => "NI",
            () => "--",
        }
    }

    fn line(&mut self, line: &str, now: Instant) {
        // Text before the slash does not belong to the command.
        let Some(body) = self.powered.then_some(()).and_then(|()| line.split_once('/')).map(|(_, body)| body)
        else {
            return;
        };
        let (body, sound) = match body.split_once(':') {
            Some((body, sum)) => {
                let sum = u8::from_str_radix(sum.trim(), 16).ok();
                let total = body.bytes().chain(sum).fold(0_u8, u8::wrapping_add);
                (body, sum.is_some() && total == 0)
            }
            None => (body, true),
        };
        let mut words = body.split_whitespace().peekable();
        let address = words.next().and_then(|word| word.parse::<u8>().ok());
        if address != Some(self.config.address) && address != Some(0) {
            return;
        }
        let axis = words.next_if(|word| word.len() == 1 && word.parse::<u8>().is_ok()).unwrap_or("0");
        let id = words.next_if(|word| word.len() == 2 && word.parse::<u8>().is_ok()).map(str::to_owned);
        let axis: u8 = axis.parse().unwrap_or(0);
        let words: Vec<&str> = words.collect();
        let result = match () {
            () if !sound => Err("BADMESSAGE"),
            () if axis > self.config.n_axes => Err("BADAXIS"),
            () => self.execute(axis, &words, now),
        };
        self.reply(axis, id.as_deref(), result);
    }

    fn reply(&mut self, axis: u8, id: Option<&str>, result: Result<String, &'static str>) {
        let (word, text) = match result {
            Ok(text) => ("OK", text),
            Err(reason) => ("RJ", reason.to_owned()),
        };
        let state = if self.axis.moving() { "BUSY" } else { "IDLE" };
        let id = id.map_or_else(String::new, |id| format!(" {id}"));
        let head = format!("{:02} {axis}", self.config.address);
        let whole = format!("@{head}{id} {word} {state} {} {text}", self.flag());
        self.n_replies += 1;
        if self.n_replies % 40 == 7 {
            self.send_line(&format!("#{head} an unrequested line"));
        }
        if whole.len() + 4 <= LINE_BYTES {
            return self.send_line(&whole);
        }
        let (first, rest) = whole.split_at(LINE_BYTES - 20);
        self.send_line(&format!("{first}\\"));
        self.send_line(&format!("#{head} cont {}", rest.trim_start()));
    }

    fn send_line(&mut self, line: &str) {
        let sum = line.as_bytes()[1..].iter().fold(0_u8, |sum, &byte| sum.wrapping_sub(byte));
        let checksum = if self.checksums { format!(":{sum:02X}") } else { String::new() };
        self.outgoing.extend_from_slice(format!("{line}{checksum}\r\n").as_bytes());
    }

    fn execute(&mut self, axis: u8, words: &[&str], now: Instant) -> Result<String, &'static str> {
        match *words {
            [] => Ok("0".to_owned()),
            ["get", setting] => self.setting(axis, setting).ok_or("BADCOMMAND"),
            ["set", "comm.checksum", value] => {
                self.checksums = value == "1";
                Ok("0".to_owned())
            }
            ["set", "maxspeed", value] => {
                let data: f64 = value.parse().map_err(|_| "BADDATA")?;
                self.max_speed_mm_s = data / SPEED_DATA / self.steps_per_mm();
                Ok("0".to_owned())
            }
            ["warnings", "clear"] => {
                (self.stalled, self.displaced, self.interrupted) = (false, false, false);
                Ok("0".to_owned())
            }
            ["stop"] => {
                self.interrupted = self.axis.moving();
                self.homing = false;
                self.axis.brake(now);
                Ok("0".to_owned())
            }
            ["home"] => self.home(now),
            ["move", "abs", target] => self.start(target, self.max_speed_mm_s, now),
            ["move", "abs", target, speed] if self.config.version >= 7.25 => {
                let data: f64 = speed.parse().map_err(|_| "BADDATA")?;
                self.start(target, data / SPEED_DATA / self.steps_per_mm(), now)
            }
            _ => Err("BADCOMMAND"),
        }
    }

    fn setting(&self, axis: u8, name: &str) -> Option<String> {
        let per_mm = self.steps_per_mm();
        let of_device = match name {
            "comm.checksum" => u8::from(self.checksums).to_string(),
            "device.id" => self.config.device_id.to_string(),
            "system.serial" => self.config.serial.to_string(),
            "version" => self.config.version.to_string(),
            _ => String::new(),
        };
        if !of_device.is_empty() {
            return (axis == 0).then_some(of_device);
        }
        let number = match name {
            "resolution" => self.config.resolution,
            "limit.min" => 0.0,
            "limit.max" => self.config.max_travel_mm * per_mm,
            "maxspeed" => self.config.max_speed_mm_s * per_mm * SPEED_DATA,
            "accel" => self.config.acceleration_mm_s2 * per_mm * ACCELERATION_DATA,
            "pos" => self.axis.at_mm * per_mm,
            _ => return None,
        };
        // A query to the device is answered for every axis.
        let times = if axis == 0 { usize::from(self.config.n_axes) } else { 1 };
        Some(vec![format!("{number:.0}"); times].join(" "))
    }

    fn movable(&self) -> Result<(), &'static str> {
        if self.emergency { Err("DRIVERDISABLED") } else { Ok(()) }
    }

    fn home(&mut self, now: Instant) -> Result<String, &'static str> {
        self.movable()?;
        (self.stalled, self.displaced, self.interrupted) = (false, false, false);
        (self.referenced, self.homing) = (false, true);
        self.axis.go(0.0, self.config.homing_mm_s, now);
        Ok("0".to_owned())
    }

    fn start(&mut self, target: &str, speed_mm_s: f64, now: Instant) -> Result<String, &'static str> {
        self.movable()?;
        let target_mm = target.parse::<f64>().map_err(|_| "BADDATA")? / self.steps_per_mm();
        let inside = (-1e-9..=self.config.max_travel_mm + 1e-9).contains(&target_mm);
        if !inside || speed_mm_s <= 0.0 {
            return Err("BADDATA");
        }
        (self.stalled, self.displaced) = (false, false);
        self.interrupted = self.axis.moving();
        self.homing = false;
        self.axis.go(target_mm, speed_mm_s.min(self.config.max_speed_mm_s), now);
        Ok("0".to_owned())
    }
}
