//! Resets and alarms: what ends, the messages, and the pause after `ALARM:n` during which nothing else happens.

use std::time::Instant;

use super::{Firmware, State};
use crate::simulators::grbl_simulator::{Dialect, Event};

/// The pause after `ALARM:n`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pause {
    pub until: Instant,
    next: Next,
}

/// What happens after the pause.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Next {
    /// Continues, locked.
    Nothing,
    /// Restarts: the banner.
    Restart,
    /// As `Restart`, after the `ok` with which GRBL answers a failed `$H`.
    OkAndRestart,
    /// Waits for a reset; one received during the pause is lost, except in FluidNC.
    Critical { reset: bool },
}

/// `ALARM:14` of FluidNC and `ALARM:11` of grblHAL: homing is required.
const FLUID_NC_UNHOMED: u32 = 14;
const GRBL_HAL_MUST_HOME: u32 = 11;

impl Firmware {
    pub(super) fn reset_received(&mut self, now: Instant) {
        self.advance(now);
        // grblHAL ignores it while its emergency stop is pressed.
        if self.active_event == Some(Event::EmergencyStop) {
            return;
        }
        match &mut self.pause {
            None => self.reset(now),
            Some(Pause { next: Next::Critical { reset }, .. }) => *reset = self.config.dialect == Dialect::FluidNc,
            Some(pause) => {
                if pause.next == Next::Nothing {
                    pause.next = Next::Restart;
                }
                // `mc_reset` of GRBL stops the spindle in the interrupt; the others do it in their main loop.
                if self.config.dialect == Dialect::Grbl {
                    self.turn_laser_off(now);
                }
            }
        }
    }

    fn reset(&mut self, now: Instant) {
        let moving = self.motion.is_some();
        match self.state {
            State::Home => self.homing_interrupted(6, now),
            _ if moving => {
                self.halt(now);
                // FluidNC stops its spindle after the pause.
                if self.config.dialect != Dialect::FluidNc {
                    self.turn_laser_off(now);
                }
                self.homed &= self.config.dialect == Dialect::FluidNc;
                self.alarm(3, State::Alarm, Next::Restart, now);
            }
            State::Critical if self.config.dialect == Dialect::FluidNc => {
                self.halt(now);
                if self.homed {
                    self.state = State::Idle;
                    self.restart(now);
                } else {
                    self.alarm(FLUID_NC_UNHOMED, State::Alarm, Next::Restart, now);
                }
            }
            State::Sleep if self.config.dialect == Dialect::FluidNc => {
                self.alarm(3, State::Alarm, Next::Restart, now);
            }
            _ => {
                let locked = matches!(self.state, State::Alarm | State::Critical | State::Sleep);
                self.state = if locked { State::Alarm } else { State::Idle };
                self.restart(now);
            }
        }
    }

    /// The main program restarts: laser off, everything cleared but position and lock.
    fn restart(&mut self, now: Instant) {
        self.halt(now);
        self.turn_laser_off(now);
        self.overrides = [100; 3];
        self.was_reset = true;
        self.banner();
        self.require_homing(now);
    }

    /// Power-on.
    pub(super) fn boot(&mut self, now: Instant) {
        self.turn_laser_off(now);
        (self.homed, self.was_reset) = (false, false);
        let homing = self.config.homing;
        let locked = homing && self.config.dialect != Dialect::GrblHal;
        self.state = if locked { State::Alarm } else { State::Idle };
        self.banner();
        match self.config.dialect {
            Dialect::FluidNc if homing => {
                self.alarm(FLUID_NC_UNHOMED, State::Alarm, Next::Nothing, now);
            }
            _ => self.require_homing(now),
        }
    }

    /// grblHAL with bit 2 of `$22`.
    fn require_homing(&mut self, now: Instant) {
        let is_required = self.config.dialect == Dialect::GrblHal && self.config.homing && self.config.homing_lock;
        if is_required && !self.homed {
            self.must_home = true;
            self.alarm(GRBL_HAL_MUST_HOME, State::Alarm, Next::Nothing, now);
        }
    }

    /// A spontaneous alarm, as from a limit switch.
    pub fn raise(&mut self, code: u32, now: Instant) {
        self.advance(now);
        let turns_laser_off = self.config.dialect != Dialect::FluidNc && !matches!(code, 4 | 5);
        self.halt(now);
        if turns_laser_off {
            self.turn_laser_off(now);
        }
        self.homed &= code == 2;
        match code {
            1 | 2 => self.alarm(code, State::Critical, Next::Critical { reset: false }, now),
            3 | 6..=9 if self.config.dialect != Dialect::FluidNc => {
                self.alarm(code, State::Alarm, Next::Restart, now);
            }
            _ => self.alarm(code, State::Alarm, Next::Nothing, now),
        }
    }

    /// Homing failed without finding a zero.
    pub(super) fn homing_failed(&mut self, code: u32, now: Instant) {
        self.halt(now);
        self.turn_laser_off(now);
        let next = if self.config.dialect == Dialect::Grbl { Next::OkAndRestart } else { Next::Restart };
        self.alarm(code, State::Alarm, next, now);
    }

    /// Homing was interrupted by a reset or the door.
    pub(super) fn homing_interrupted(&mut self, code: u32, now: Instant) {
        self.homing_failed(code, now);
    }

    fn alarm(&mut self, code: u32, state: State, next: Next, now: Instant) {
        self.state = state;
        self.send_line(&format!("ALARM:{code}"));
        self.pause = Some(Pause { until: now + self.config.dialect.alarm_pause(), next });
    }

    pub(super) fn end_pause(&mut self, pause: Pause, now: Instant) {
        self.pause = None;
        match pause.next {
            Next::Nothing => {}
            Next::Restart => self.restart(now),
            Next::OkAndRestart => {
                self.send_line("ok");
                self.restart(now);
            }
            Next::Critical { reset } => {
                self.send_line("[MSG:Reset to continue]");
                if self.config.dialect == Dialect::GrblHal {
                    self.rx.clear();
                }
                if reset {
                    self.reset(now);
                }
            }
        }
    }

    fn banner(&mut self) {
        let banner = self.config.banner.clone();
        self.send_line("");
        self.send_line(&banner);
        if self.state == State::Alarm {
            self.send_line("[MSG:'$H'|'$X' to unlock]");
        }
        self.reports = 0;
    }
}
