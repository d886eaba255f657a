//! Execution of commands.

use std::time::{Duration, Instant};

use super::{MarlinFirmware, N_BLOCKS, QUICK_STOP_DROP_TIME, Then, Waiting, command_of};
use crate::simulators::simulator::LogEvent;

impl MarlinFirmware {
    /// Executes one command after the other; one that waits delays all that follow.
    pub(super) fn work(&mut self, now: Instant) {
        loop {
            if let Some(waiting) = self.waiting {
                if !self.go_on(waiting, now) {
                    if now - self.busy_sent_at >= self.keepalive && !self.keepalive.is_zero() {
                        self.busy_sent_at = now;
                        self.send_line("echo:busy: processing");
                    }
                    return;
                }
                continue;
            }
            let Some(line) = self.lines.pop_front() else { return };
            self.busy_sent_at = now;
            self.execute(&line, now);
        }
    }

    fn is_idle(&self) -> bool {
        self.blocks.is_empty() && !self.axis.moving() && self.dropping_until.is_none()
    }

    fn go_on(&mut self, waiting: Waiting, now: Instant) -> bool {
        match waiting {
            Waiting::Synchronized(_) if !self.is_idle() => return false,
            Waiting::Synchronized(then) => {
                self.waiting = None;
                match then {
                    Then::Answer => {}
                    Then::LaserOn(power) => {
                        self.light = Some(power);
                        self.last_move_at = now;
                        self.event_log.record(now, LogEvent::LightOn(power));
                    }
                    Then::LaserOff => self.turn_laser_off(now),
                    Then::Home => {
                        self.axis.go(0.0, self.config.homing_mm_s, now);
                        self.waiting = Some(Waiting::Homed);
                        return true;
                    }
                }
                self.ok();
            }
            Waiting::Homed => {
                if self.axis.moving() {
                    return false;
                }
                // A quick stop on the way ends only the approach: the current position is taken for the switch.
                self.waiting = None;
                self.axis.at_mm = 0.0;
                (self.planned_mm, self.origin_mm) = (0.0, 0.0);
                self.ok();
            }
            Waiting::Room { target_mm, speed_mm_s } => {
                if self.blocks.len() >= N_BLOCKS {
                    return false;
                }
                self.waiting = None;
                self.plan(target_mm, speed_mm_s, now);
                self.ok();
            }
        }
        true
    }

    fn plan(&mut self, target_mm: f64, speed_mm_s: f64, now: Instant) {
        if self.dropping_until.is_some() || target_mm == self.planned_mm {
            return;
        }
        if self.blocks.is_empty() {
            self.first_block_at = Some(now);
        }
        self.planned_mm = target_mm;
        self.blocks.push_back((target_mm + self.origin_mm, speed_mm_s));
    }

    fn execute(&mut self, line: &str, now: Instant) {
        let word = |letter: char| {
            line.split_whitespace().skip(1).find_map(|word| word.strip_prefix(letter)?.parse::<f64>().ok())
        };
        let wait = |then| Some(Waiting::Synchronized(then));
        match command_of(line) {
            "G0" | "G1" => {
                if let Some(feed) = word('F') {
                    self.speed_mm_s = (feed / 60.0).min(self.config.max_speed_mm_s);
                }
                let target_mm = word(self.config.axis).unwrap_or(self.planned_mm);
                let target_mm = target_mm.clamp(0.0, self.config.max_travel_mm);
                // Positions are rounded to steps.
                let target_mm = (target_mm * self.config.steps_per_mm).round() / self.config.steps_per_mm;
                self.waiting = Some(Waiting::Room { target_mm, speed_mm_s: self.speed_mm_s });
            }
            "G28" => self.waiting = wait(Then::Home),
            "M400" => self.waiting = wait(Then::Answer),
            "M3" if self.config.laser => self.waiting = wait(Then::LaserOn(word('S').unwrap_or(255.0) / 255.0)),
            "M5" if self.config.laser => self.waiting = wait(Then::LaserOff),
            "M410" => {
                if !self.config.emergency_parser {
                    self.axis.halt(now);
                    self.blocks.clear();
                    self.dropping_until = Some(now + QUICK_STOP_DROP_TIME);
                }
                self.ok();
            }
            "M112" => self.kill(now),
            "M113" => {
                self.keepalive = Duration::from_secs_f64(word('S').unwrap_or(2.0).clamp(0.0, 60.0));
                self.ok();
            }
            "M84" | "M18" | "M17" => {
                self.last_move_at = now;
                self.ok();
            }
            "G21" | "G90" | "M110" => self.ok(),
            "M114" => self.send_position(),
            "M115" => self.send_firmware_info(),
            "M503" => self.send_settings(),
            "M211" => {
                let top_mm = self.config.max_travel_mm;
                self.send_line(&format!(
                    "echo:Soft endstops: On  Min:  X0.00 Y0.00 Z0.00   Max:  X{top_mm:.2} Y{top_mm:.2} Z{top_mm:.2}"
                ));
                self.ok();
            }
            _ => {
                self.send_line(&format!("echo:Unknown command: \"{line}\""));
                self.ok();
            }
        }
    }

    fn send_position(&mut self) {
        let of_axis = |value: String, zero: &str| {
            ['X', 'Y', 'Z'].map(|letter| if letter == self.config.axis { value.clone() } else { zero.to_owned() })
        };
        let [x, y, z] = of_axis(format!("{:.2}", self.planned_mm), "0.00");
        let steps = ((self.axis.at_mm - self.origin_mm) * self.config.steps_per_mm).round();
        let [a, b, c] = of_axis(format!("{steps}"), "0");
        self.send_line(&format!("X:{x} Y:{y} Z:{z} E:0.00 Count X:{a} Y:{b} Z:{c}"));
        self.ok();
    }

    fn send_firmware_info(&mut self) {
        let name = self.config.name.clone();
        self.send_line(&format!(
            "FIRMWARE_NAME:Marlin 2.1.2.4 (Jan  1 2024 12:00:00) SOURCE_CODE_URL:github.com/MarlinFirmware/Marlin \
             PROTOCOL_VERSION:1.0 MACHINE_TYPE:{name} EXTRUDER_COUNT:1 UUID:cede2a2f-41a2-4748-9b12-c55c62f367ff"
        ));
        let flag = |on: bool| u8::from(on);
        self.send_line("Cap:SERIAL_XON_XOFF:0");
        self.send_line(&format!("Cap:EMERGENCY_PARSER:{}", flag(self.config.emergency_parser)));
        self.send_line("Cap:BUSY_PROTOCOL:1");
        self.ok();
    }

    fn send_settings(&mut self) {
        let all =
            |command: &str, value: f64| format!("echo:  {command} X{value:.2} Y{value:.2} Z{value:.2} E93.00");
        let config = self.config.clone();
        self.send_line("echo:; Steps per unit:");
        self.send_line(&all("M92", config.steps_per_mm));
        self.send_line("echo:; Max feedrates (units/s):");
        self.send_line(&all("M203", config.max_speed_mm_s));
        self.send_line("echo:; Max Acceleration (units/s2):");
        self.send_line(&all("M201", config.acceleration_mm_s2));
        self.send_line("echo:; Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>):");
        let acceleration = config.acceleration_mm_s2;
        self.send_line(&format!("echo:  M204 P{acceleration:.2} R{acceleration:.2} T{acceleration:.2}"));
        self.send_line("echo:; Home offset:");
        self.send_line("echo:  M206 X0.00 Y0.00 Z0.00");
        self.ok();
    }
}
