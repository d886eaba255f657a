//! From the first stop to the first position: identity and settings of the device, and that it is at rest.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::commands::SPEED_DATA;
use super::{Activity, CommandKind, LastReport, Link, Machine, Session, being_opened};
use crate::drivers::zaber::protocol::{Kind, Message};
use crate::drivers::zaber::reason_meaning;
use crate::lines::line_reader::shortened;
use crate::params::ZABER_SILENCE;
use crate::{DeviceIdentity, Homing, StageCapabilities, StageError};

/// Interval after which an unanswered query is repeated: a device may still be starting.
const QUERY_RETRY: Duration = Duration::from_millis(300);

/// The device's data for an acceleration of one microstep/s² (ASCII Protocol Manual, "data conversion").
const ACCELERATION_DATA: f64 = 1.6384 / 10_000.0;

/// Firmware from which `move abs` accepts a speed; with older firmware a speed would have to be written to the device's
/// memory.
const OLDEST_FIRMWARE: f64 = 7.25;

/// The queries, in this order, and whether each is to the axis. Answers of the first ones may lack checksums.
const QUERIES: [(&str, bool); 12] = [
    ("stop", true),
    ("get comm.checksum", false),
    ("set comm.checksum 1", false),
    ("get device.id", false),
    ("get system.serial", false),
    ("get version", false),
    ("get resolution", true),
    ("get limit.min", true),
    ("get limit.max", true),
    ("get maxspeed", true),
    ("get accel", true),
    ("get pos", true),
];

/// The first query whose answer must have a checksum.
const N_UNCHECKED: usize = 3;

/// Progress of an opening.
#[derive(Debug)]
pub struct Opening {
    since: Instant,
    query: usize,
    queried_at: Option<Instant>,
    /// The first line that is not Zaber's.
    foreign: Option<(Instant, String)>,
    answers: BTreeMap<&'static str, String>,
}

impl Opening {
    pub fn foreign_line(&mut self, received: String, now: Instant) {
        self.foreign.get_or_insert((now, received));
    }

    fn text(&self, query: &str) -> &str {
        self.answers.get(query).map_or("", String::as_str)
    }

    fn number(&self, query: &'static str, port_name: &str) -> Result<f64, StageError> {
        let text = self.text(query);
        text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| {
            wrong(port_name, &format!("a number as answer to `{query}`"), format!("`{}`", shortened(text)))
        })
    }
}

impl Session {
    /// A stop first: a terminated program may have left it moving.
    pub(super) fn begin_opening(&mut self, now: Instant) {
        self.should_be_open = false;
        self.reset_dialogue();
        (self.homed, self.seen) = (false, None);
        self.fault = Some(being_opened());
        self.outgoing = self.stop_line();
        self.link = Link::Opening(Opening {
            since: now,
            query: 0,
            queried_at: None,
            foreign: None,
            answers: BTreeMap::new(),
        });
        self.opening_tick(now);
    }

    pub(super) fn opening_message(&mut self, message: &Message, now: Instant) {
        let Link::Opening(opening) = &mut self.link else { return };
        let Kind::Reply { accepted, status } = &message.kind else { return };
        let at = self.pending.iter().position(|pending| Some(pending.id) == message.id);
        let Some(pending) = at.and_then(|at| self.pending.remove(at)) else { return };
        let (query, _) = QUERIES[opening.query];
        if pending.text != query || (opening.query >= N_UNCHECKED && !message.checked) {
            return;
        }
        (opening.foreign, opening.queried_at) = (None, None);
        if !accepted {
            let found = format!("`{}` ({})", shortened(&message.text), reason_meaning(&message.text));
            return self.down(wrong(&self.port_name, &format!("an answer to `{query}`"), found));
        }
        opening.answers.insert(query, message.text.clone());
        // Written only if it is not set already.
        opening.query += if query == "get comm.checksum" && message.text == "1" { 2 } else { 1 };
        if opening.query < QUERIES.len() {
            return self.opening_tick(now);
        }
        if status.busy {
            opening.query = QUERIES.len() - 1;
            return;
        }
        match self.machine_and_position() {
            Ok((machine, steps)) => {
                self.machine = Some(machine);
                (self.link, self.fault, self.activity) = (Link::Up, None, Activity::Rest);
                self.seen = Some(LastReport { steps, busy: false, at: now });
                self.received_at = Some(now);
                // An emergency stop may be pressed already.
                self.evaluate_flag(&status.flag, pending.sent_at, now);
            }
            Err(fault) => self.down(fault),
        }
    }

    pub(super) fn opening_tick(&mut self, now: Instant) {
        let Link::Opening(opening) = &mut self.link else { return };
        let (query, of_axis) = QUERIES[opening.query];
        let waited = now - opening.since;
        if let Some((_, text)) = opening.foreign.take_if(|(at, _)| now - *at > ZABER_SILENCE) {
            let fault = wrong(&self.port_name, "a device with Zaber's ASCII protocol", format!("`{text}`"));
            return self.down(fault);
        }
        if waited > self.config.open_limit {
            let (command, waited_ms) = (query.to_owned(), waited.as_millis() as u64);
            return self.down(StageError::NoResponse { command, waited_ms });
        }
        // The axis is queried at a slower pace while it brakes.
        let pause = if query == "get pos" { QUERY_RETRY / 10 } else { QUERY_RETRY };
        if opening.queried_at.is_none_or(|at| now - at > pause) {
            opening.queried_at = Some(now);
            let scope = if of_axis { self.config.axis } else { 0 };
            self.send(scope, query, CommandKind::Opening, now);
        }
    }

    /// The settings used by the driver, and the position of the axis.
    fn machine_and_position(&self) -> Result<(Machine, i64), StageError> {
        let Link::Opening(opening) = &self.link else { return Err(being_opened()) };
        let (port_name, config) = (self.port_name.as_str(), &self.config);
        let serial = opening.text("get system.serial").to_owned();
        if config.expected_serial.is_some_and(|expected| serial != expected.to_string()) {
            let expected = format!("the device {}", config.expected_serial.unwrap_or_default());
            return Err(wrong(port_name, &expected, format!("the device {serial}")));
        }
        let resolution = opening.number("get resolution", port_name)?;
        let steps_per_mm = resolution * config.steps_per_turn / config.travel_per_turn_mm;
        if !(steps_per_mm.is_finite() && steps_per_mm > 0.0) {
            return Err(wrong(port_name, "a resolution above 0", format!("resolution {resolution}")));
        }
        let limits_mm = [opening.number("get limit.min", port_name)?, opening.number("get limit.max", port_name)?]
            .map(|steps| steps / steps_per_mm);
        for end_mm in [config.travel_mm.0, config.travel_mm.1] {
            let from_zero_mm = if config.reversed { -end_mm } else { end_mm };
            let device_mm = from_zero_mm + config.zero_at_device_mm;
            // Tolerance of one microstep.
            if device_mm < limits_mm[0] - 1.0 / steps_per_mm || device_mm > limits_mm[1] + 1.0 / steps_per_mm {
                let expected = format!("a device that reaches {device_mm} mm (stage position {end_mm} mm)");
                let [low_mm, high_mm] = limits_mm;
                let found = format!("one of {low_mm:.3} to {high_mm:.3} mm (limit.min, limit.max)");
                return Err(wrong(port_name, &expected, found));
            }
        }
        let firmware = opening.text("get version").to_owned();
        if opening.number("get version", port_name)? < OLDEST_FIRMWARE {
            let expected = format!("firmware {OLDEST_FIRMWARE} or newer");
            return Err(wrong(port_name, &expected, format!("{firmware}: update it with Zaber Launcher")));
        }
        let fastest_mm_s = opening.number("get maxspeed", port_name)? / SPEED_DATA / steps_per_mm;
        let acceleration_mm_s2 = opening.number("get accel", port_name)? / ACCELERATION_DATA / steps_per_mm;
        let machine = Machine {
            identity: DeviceIdentity {
                driver: "zaber",
                vendor: "Zaber".to_owned(),
                model: format!("device {}", opening.text("get device.id")),
                serial: serial.clone(),
                firmware,
            },
            capabilities: StageCapabilities {
                kind: config.kind,
                travel_mm: config.travel_mm,
                max_speed_mm_s: fastest_mm_s.min(config.max_speed_mm_s),
                // 0 switches ramps off.
                acceleration_mm_s2: Some(acceleration_mm_s2).filter(|value| *value > 0.0),
                homing: Homing::Required,
                resolution_mm: 1.0 / steps_per_mm,
                follows_frames: false,
                frame_pitch_mm: None,
            },
            serial,
            steps_per_mm,
        };
        Ok((machine, opening.number("get pos", port_name)? as i64))
    }
}

fn wrong(port_name: &str, expected: &str, found: String) -> StageError {
    StageError::WrongDevice { port_name: port_name.to_owned(), expected: expected.to_owned(), found }
}
