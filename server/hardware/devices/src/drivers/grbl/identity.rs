//! Identity and settings of a controller, from `$I` and `$$`, compared with the configuration.

use std::collections::BTreeMap;
use std::time::Duration;

use super::fault::Fault;
use super::{Axis, Dialect, GrblConfig, LaserMode};
use crate::{DeviceIdentity, Homing, StageCapabilities};

/// The controller's description of itself.
#[derive(Debug, Clone, Default)]
pub struct Description {
    feedback: BTreeMap<String, String>,
    /// Every line of `$I`, without brackets.
    lines: Vec<String>,
    settings: BTreeMap<u32, String>,
}

/// The settings used by the driver.
#[derive(Debug, Clone)]
pub struct Machine {
    pub identity: DeviceIdentity,
    pub capabilities: StageCapabilities,
    /// Value of `S` at full power.
    pub full_power: f64,
    pub dialect: Dialect,
    /// Whether it answers queries while homing: FluidNC does, GRBL does not, grblHAL depending on `$10`.
    pub answers_while_homing: bool,
    /// Pause of grblHAL's reports at every switch while homing (`$26`, debouncing).
    pub homing_pause: Duration,
    /// What happens to the laser when the host is lost.
    pub lost_host: &'static str,
}

/// Tolerance of steps per mm: the settings are printed with three decimals.
const STEPS_TOLERANCE: f64 = 2e-3;

/// Bit of `$10` of grblHAL that lets it report while homing.
const REPORTS_WHILE_HOMING: u32 = 1 << 12;

/// Bits of `$10` of grblHAL of which one must be set for a position: machine positions, or the work offset.
const REPORTS_POSITIONS: u32 = 1 | 1 << 5;

/// Bit of `$22` that enables homing.
const HOMING_ENABLED: u32 = 1;

impl Description {
    pub fn feedback(&mut self, key: &str, text: &str) {
        self.lines.push(format!("{key}:{text}"));
        self.feedback.insert(key.to_owned(), text.to_owned());
    }

    pub fn setting(&mut self, number: u32, value: &str) {
        self.settings.insert(number, value.to_owned());
    }

    /// Checks that the expected name is in a line of `$I`, before the settings are read.
    pub fn check_name(&self, config: &GrblConfig, port_name: &str) -> Result<(), Fault> {
        match &config.expected_name {
            Some(expected) if !self.lines.iter().any(|line| has_words(line, expected)) => {
                let found = format!("one that reports `{}`", self.lines.join("`, `"));
                Err(wrong(port_name, &format!("a controller named `{expected}`"), found))
            }
            _ => Ok(()),
        }
    }

    /// Checks units, steps, travel and laser mode; returns the settings used by the driver.
    pub fn machine(&self, config: &GrblConfig, port_name: &str) -> Result<Machine, Fault> {
        // FluidNC has no such setting: it reports in millimetres.
        if self.dialect() != Dialect::FluidNc && self.number(13, port_name)? != 0.0 {
            return Err(wrong(
                port_name,
                "reports in millimetres ($13=0)",
                "$13=1, inches: send $13=0".to_owned(),
            ));
        }
        let steps_per_mm = self.of_axis(100, config.axis, port_name)?;
        if (steps_per_mm - config.steps_per_mm).abs() > STEPS_TOLERANCE {
            let expected = format!("{} steps/mm (${})", config.steps_per_mm, 100 + config.axis.idx());
            return Err(wrong(port_name, &expected, format!("{steps_per_mm}")));
        }
        let mode = self.number(32, port_name)?;
        if mode != 1.0 {
            let found = match mode {
                2.0 => "$32=2, which is grblHAL's lathe mode: send $32=1".to_owned(),
                _ => format!("$32={mode}: send $32=1"),
            };
            return Err(wrong(port_name, "laser mode ($32=1), in which a hold turns the laser off", found));
        }
        let homing = if self.number(22, port_name)? as u32 & HOMING_ENABLED != 0 {
            Homing::Required
        } else {
            Homing::Absent
        };
        if homing == Homing::Required {
            self.check_travel(config, port_name)?;
        }
        let rate_mm_s = self.of_axis(110, config.axis, port_name)? / 60.0;
        let dialect = self.dialect();
        let answers_while_homing = match dialect {
            Dialect::Grbl => false,
            Dialect::GrblHal => self.check_reports(port_name)?,
            Dialect::FluidNc => true,
        };
        Ok(Machine {
            identity: self.identity(),
            dialect,
            homing_pause: self.homing_pause(),
            lost_host: self.lost_host(config.laser_mode),
            capabilities: StageCapabilities {
                kind: config.kind,
                travel_mm: config.travel_mm,
                max_speed_mm_s: rate_mm_s.min(config.max_speed_mm_s),
                acceleration_mm_s2: Some(self.of_axis(120, config.axis, port_name)?),
                homing,
                resolution_mm: 1.0 / steps_per_mm,
                follows_frames: false,
                frame_pitch_mm: None,
            },
            full_power: self.number(30, port_name)?,
            answers_while_homing,
        })
    }

    /// Checks the report settings of grblHAL; returns whether it reports while homing.
    fn check_reports(&self, port_name: &str) -> Result<bool, Fault> {
        let mask = self.number(10, port_name)? as u32;
        if mask & REPORTS_POSITIONS == 0 {
            return Err(wrong(
                port_name,
                "reports with a position ($10)",
                format!("$10={mask}: send $10={}", mask | 1),
            ));
        }
        // Otherwise `?` and `!` received while a `$` line is read or executed would become characters of a line.
        if self.settings.get(&39).is_some_and(|value| value.parse() == Ok(0.0)) {
            return Err(wrong(
                port_name,
                "`?` and `!` accepted at any time ($39=1)",
                "$39=0: send $39=1".to_owned(),
            ));
        }
        let reports = mask & REPORTS_WHILE_HOMING != 0;
        if !reports {
            let wanted = mask | REPORTS_WHILE_HOMING;
            tracing::warn!(
                port_name,
                "no reports while homing; send $10={wanted} so that faults during homing are noticed sooner"
            );
        }
        Ok(reports)
    }

    /// Machine space is `-$130..0`, or starts at 0 if homing sets the origin (`Z` in the build options).
    fn check_travel(&self, config: &GrblConfig, port_name: &str) -> Result<(), Fault> {
        let span_mm = self.of_axis(130, config.axis, port_name)?;
        let options = self.feedback.get("OPT").map_or("", String::as_str);
        let letters = options.split(',').next().unwrap_or_default();
        let (low_mm, high_mm) = if letters.contains('Z') { (-span_mm, span_mm) } else { (-span_mm, 0.0) };
        for end_mm in [config.travel_mm.0, config.travel_mm.1] {
            let machine_mm = machine_from_stage(end_mm, config.zero_at_machine_mm, config.reversed);
            if machine_mm < low_mm || machine_mm > high_mm {
                let expected = format!("a machine that reaches {machine_mm} mm (stage position {end_mm} mm)");
                return Err(wrong(
                    port_name,
                    &expected,
                    format!("one of {low_mm} to {high_mm} mm (${})", 130 + config.axis.idx()),
                ));
            }
        }
        Ok(())
    }

    fn identity(&self) -> DeviceIdentity {
        let (firmware, serial) = self.version_and_name();
        let vendor = self.feedback.get("BOARD").cloned().unwrap_or_default();
        let model = match self.dialect() {
            Dialect::Grbl => "Grbl",
            Dialect::GrblHal => "grblHAL",
            Dialect::FluidNc => "FluidNC",
        };
        DeviceIdentity { driver: "grbl", vendor, model: model.to_owned(), serial, firmware }
    }

    /// `[VER:1.1h.20190825:name]`: version with its date, and the text stored by `$I=`.
    fn version_and_name(&self) -> (String, String) {
        let version = self.feedback.get("VER").map_or("", String::as_str);
        let (version, name) = version.split_once(':').unwrap_or((version, ""));
        (version.to_owned(), name.to_owned())
    }

    /// The firmware, as far as it is known.
    pub fn dialect(&self) -> Dialect {
        let says = |key: &str, word: &str| self.feedback.get(key).is_some_and(|text| text.contains(word));
        match () {
            () if says("FIRMWARE", "grblHAL") => Dialect::GrblHal,
            () if says("VER", "FluidNC") => Dialect::FluidNc,
            () => Dialect::Grbl,
        }
    }

    fn homing_pause(&self) -> Duration {
        let debounce_ms = self.settings.get(&26).and_then(|value| value.parse::<f64>().ok()).unwrap_or(0.0);
        Duration::from_millis(debounce_ms.clamp(0.0, 1000.0) as u64)
    }

    fn lost_host(&self, mode: LaserMode) -> &'static str {
        let on = |value: &String| value.parse() == Ok(1.0);
        let sleeps = self.dialect() == Dialect::GrblHal && self.settings.get(&62).is_some_and(on);
        match mode {
            LaserMode::Dynamic => "the laser goes off at the end of the current move (M4)",
            LaserMode::Constant if sleeps => {
                "the laser stays on until this program is started again, at rest for 5 minutes at most (grblHAL, $62=1)"
            }
            LaserMode::Constant => {
                "the laser stays on until this program is started again or the controller is reset: its firmware has no \
                 watchdog"
            }
        }
    }

    fn of_axis(&self, first: u32, axis: Axis, port_name: &str) -> Result<f64, Fault> {
        self.number(first + axis.idx() as u32, port_name)
    }

    fn number(&self, number: u32, port_name: &str) -> Result<f64, Fault> {
        let value = self.settings.get(&number).map(String::as_str);
        match value.and_then(|value| value.parse().ok()).filter(|value: &f64| value.is_finite()) {
            Some(value) => Ok(value),
            None => {
                let found = value.map_or_else(|| "none".to_owned(), |value| format!("${number}={value}"));
                Err(wrong(port_name, &format!("a controller with the setting ${number}"), found))
            }
        }
    }
}

/// Whether `text` contains `words`, not as a part of longer words.
fn has_words(text: &str, words: &str) -> bool {
    let in_a_word = |c: Option<char>| c.is_some_and(char::is_alphanumeric);
    let (starts, ends) = (in_a_word(words.chars().next()), in_a_word(words.chars().next_back()));
    text.match_indices(words).any(|(at, _)| {
        let before = in_a_word(text[..at].chars().next_back()) && starts;
        let after = in_a_word(text[at + words.len()..].chars().next()) && ends;
        !before && !after
    })
}

/// Machine position of a stage position, mm.
pub fn machine_from_stage(position_mm: f64, zero_at_machine_mm: f64, reversed: bool) -> f64 {
    if reversed { zero_at_machine_mm - position_mm } else { zero_at_machine_mm + position_mm }
}

/// Stage position of a machine position, mm.
pub fn stage_from_machine(machine_mm: f64, zero_at_machine_mm: f64, reversed: bool) -> f64 {
    if reversed { zero_at_machine_mm - machine_mm } else { machine_mm - zero_at_machine_mm }
}

fn wrong(port_name: &str, expected: &str, found: String) -> Fault {
    Fault::WrongDevice { port_name: port_name.to_owned(), expected: expected.to_owned(), found }
}
