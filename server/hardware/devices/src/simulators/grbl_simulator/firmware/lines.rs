//! Text lines: `$` commands and G-code.

use std::time::{Duration, Instant};

use super::{Firmware, Planned, Spindle, State};
use crate::simulators::grbl_simulator::Dialect;

impl Firmware {
    pub(super) fn read_lines(&mut self, now: Instant) {
        loop {
            if let Some((at, reply)) = self.reply_at {
                if now < at {
                    return;
                }
                self.reply_at = None;
                self.send_line(reply);
            }
            if !self.reads() {
                return;
            }
            let Some(end) = self.rx.iter().position(|byte| matches!(byte, b'\n' | b'\r')) else { return };
            let line: String = self.rx[..end]
                .iter()
                .filter(|&&byte| byte > b' ')
                .map(|&byte| char::from(byte.to_ascii_uppercase()))
                .collect();
            if self.must_wait(&line) {
                return;
            }
            self.rx.drain(..=end);
            self.execute(&line, now);
        }
    }

    /// A hold, a door, homing and sleep leave lines unread; so does GRBL after a limit alarm.
    fn reads(&self) -> bool {
        let ignores_lines = self.state == State::Critical && self.config.dialect == Dialect::Grbl;
        let busy = matches!(self.state, State::Home | State::Hold | State::Door | State::Sleep);
        self.pause.is_none() && !busy && !ignores_lines
    }

    /// Spindle words and dwells wait until the planned moves are done; moves wait for room in the planner.
    fn must_wait(&self, line: &str) -> bool {
        let planned = self.state == State::Run && !line.starts_with('$');
        let synchronises = ["M3", "M4", "M5", "G4P"].iter().any(|word| line.contains(word));
        let full = self.planned.len() >= self.config.dialect.blocks();
        let jogs_full = self.state == State::Jog && line.starts_with("$J=") && full;
        // A jog that is being cancelled does not accept another.
        let ending = self.after_jog.is_some();
        ending || jogs_full || (planned && (synchronises || full))
    }

    fn execute(&mut self, line: &str, now: Instant) {
        let hal = self.config.dialect == Dialect::GrblHal;
        if self.state == State::Critical && line.starts_with('$') {
            return self.send_line(match line {
                _ if hal => "error:79",
                "$X" => "ok",
                _ => "error:8",
            });
        }
        let idle = matches!(self.state, State::Idle | State::Alarm);
        match line {
            "" => self.send_line("ok"),
            "$X" => self.unlock(),
            "$C" if matches!(self.state, State::Idle) => {
                self.state = State::Check;
                self.send_line("[MSG:Enabled]");
                self.send_line("ok");
            }
            "$SLP" if idle => {
                self.send_line("ok");
                self.turn_laser_off(now);
                self.state = State::Sleep;
            }
            "$I" | "$$" | "$H" if !idle => self.send_line("error:8"),
            "$I" => self.send_build(),
            "$$" => self.send_settings(),
            "$H" if !self.config.homing => self.send_line("error:5"),
            "$H" if self.door_open => self.send_line("error:13"),
            "$H" => self.home(now),
            _ => match line.strip_prefix("$J=") {
                Some(words) => self.jog(words, now),
                None if line.starts_with('$') => self.set(line, idle),
                None if matches!(self.state, State::Alarm | State::Jog | State::Critical) => {
                    self.send_line("error:9")
                }
                None => self.block(line, now),
            },
        }
    }

    fn unlock(&mut self) {
        if self.state == State::Alarm {
            if self.door_open {
                return self.send_line("error:13");
            }
            if self.must_home {
                return self.send_line("error:46");
            }
            self.send_line("[MSG:Caution: Unlocked]");
            self.state = State::Idle;
            self.homed |= self.config.dialect == Dialect::FluidNc;
        }
        self.send_line("ok");
    }

    /// `$10` only. grblHAL/core 8689918, which its simulator uses, does not return from a setting written after a soft
    /// reset: `onSettingsChanged` of `gcode.c` then recurses.
    fn set(&mut self, line: &str, idle: bool) {
        match line.strip_prefix("$10=").and_then(|value| value.parse().ok()) {
            Some(_) if !idle => self.send_line("error:8"),
            Some(_) if self.config.dialect == Dialect::GrblHal && self.was_reset => {
                self.hung = true;
            }
            Some(mask) => {
                self.report_mask = mask;
                self.send_line("ok");
            }
            None => self.send_line("error:3"),
        }
    }

    fn jog(&mut self, words: &str, now: Instant) {
        if !matches!(self.state, State::Idle | State::Jog) {
            return self.send_line("error:8");
        }
        let Some(words) = words_of(words) else { return self.send_line("error:2") };
        let absolute = !words.contains(&('G', 91.0));
        let (Some(axis_mm), Some(feed_mm_min)) = (value(&words, self.config.axis), value(&words, 'F')) else {
            return self.send_line("error:22");
        };
        let target_mm = if absolute { axis_mm } else { self.at_mm + axis_mm };
        if self.config.soft_limits && !self.within(target_mm) {
            return self.send_line("error:15");
        }
        self.plan(target_mm, feed_mm_min, State::Jog, now);
        self.send_line("ok");
    }

    /// One line of G-code: the words needed here, and error 20 for others.
    fn block(&mut self, line: &str, now: Instant) {
        let Some(words) = words_of(line) else { return self.send_line("error:2") };
        let mut modal = self.modal;
        let (mut names_g1, mut machine_space, mut dwell) = (false, false, None);
        for &(letter, number) in &words {
            match (letter, number) {
                ('G', 0.0) => modal.feeds = false,
                ('G', 1.0) => (modal.feeds, names_g1) = (true, true),
                ('G', 4.0) => dwell = value(&words, 'P'),
                ('G', 53.0) => machine_space = true,
                ('G', 90.0) => modal.absolute = true,
                ('G', 91.0) => modal.absolute = false,
                ('G', 21.0 | 94.0) => {}
                ('M', 3.0) => modal.spindle = Spindle::Constant,
                ('M', 4.0) => modal.spindle = Spindle::Dynamic,
                ('M', 5.0) => modal.spindle = Spindle::Off,
                ('F', feed) => modal.feed_mm_min = feed,
                ('S', speed) => modal.speed = speed.min(self.config.max_spindle),
                ('P', _) => {}
                (letter, _) if letter == self.config.axis => {}
                _ => return self.send_line("error:20"),
            }
        }
        let axis = value(&words, self.config.axis);
        let feeding = names_g1 || (modal.feeds && axis.is_some());
        if feeding && modal.feed_mm_min == 0.0 {
            return self.send_line("error:22");
        }
        if self.state == State::Check {
            return self.send_line("ok");
        }
        let target_mm =
            axis.map(|axis_mm| if modal.absolute || machine_space { axis_mm } else { self.at_mm + axis_mm });
        let switched = modal.spindle != self.modal.spindle;
        self.modal = modal;
        self.update_light(now);
        if let Some(target_mm) = target_mm {
            if self.config.soft_limits && !self.within(target_mm) {
                return self.raise(2, now);
            }
            self.plan(target_mm, self.modal.feed_mm_min, State::Run, now);
        }
        let spin_up = if switched { self.config.spindle_delay } else { Duration::ZERO };
        let wait = spin_up + dwell.and_then(|s| Duration::try_from_secs_f64(s).ok()).unwrap_or_default();
        if wait.is_zero() {
            self.send_line("ok");
        } else {
            self.reply_at = Some((now + wait, "ok"));
        }
    }

    fn plan(&mut self, target_mm: f64, feed_mm_min: f64, state: State, now: Instant) {
        let speed_mm_s = (feed_mm_min / 60.0).min(self.config.max_speed_mm_s);
        self.planned.push_back(Planned { target_mm, speed_mm_s });
        if self.motion.is_none() {
            self.state = state;
            self.begin(target_mm, speed_mm_s, now);
        }
    }

    fn within(&self, machine_mm: f64) -> bool {
        (-self.config.max_travel_mm..=0.0).contains(&machine_mm)
    }
}

/// Letters and numbers of a line; `None` if it has another form.
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
