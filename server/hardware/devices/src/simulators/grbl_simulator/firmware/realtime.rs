//! Realtime commands: single bytes executed at once, in every state.

use std::time::Instant;

use super::{DOOR_RESTORE, Firmware, State};
use crate::simulators::grbl_simulator::dialect::Dialect;

impl Firmware {
    pub(super) fn receive_bytes(&mut self, bytes: &[u8], now: Instant) {
        for &byte in bytes {
            match byte {
                0x18 => self.reset_received(now),
                b'?' => self.query = true,
                b'!' => self.hold(now),
                b'~' => self.resume(now),
                0x84 => self.stop_for_door(now),
                0x85 => self.cancel_jog(now),
                0x90..=0x9d => self.change_override(byte, now),
                0x80.. => {}
                _ if self.rx.len() < self.config.dialect.rx_bytes() => self.rx.push(byte),
                _ => {}
            }
        }
    }

    /// From any source: a pendant sends them, too. Feed and spindle change by tens and ones, the rapid by quarters.
    pub fn change_override(&mut self, byte: u8, now: Instant) {
        let by = |percent: u32, step: i64| (i64::from(percent) + step).clamp(10, 200) as u32;
        let [feed, rapid, spindle] = &mut self.overrides;
        match byte {
            0x90 => *feed = 100,
            0x91 => *feed = by(*feed, 10),
            0x92 => *feed = by(*feed, -10),
            0x93 => *feed = by(*feed, 1),
            0x94 => *feed = by(*feed, -1),
            0x95 => *rapid = 100,
            0x96 => *rapid = 50,
            0x97 => *rapid = 25,
            0x99 => *spindle = 100,
            0x9a => *spindle = by(*spindle, 10),
            0x9b => *spindle = by(*spindle, -10),
            0x9c => *spindle = by(*spindle, 1),
            0x9d => *spindle = by(*spindle, -1),
            _ => return,
        }
        self.reports_overrides = true;
        self.update_light(now);
    }

    fn hold(&mut self, now: Instant) {
        self.advance(now);
        match self.state {
            State::Run => {
                self.brake(now);
                self.state = State::Hold;
            }
            State::Jog if self.config.dialect != Dialect::GrblHal => self.end_jog(State::Idle, now),
            State::Idle => self.state = State::Hold,
            _ => {}
        }
    }

    /// grblHAL drops unread input, in every state.
    fn cancel_jog(&mut self, now: Instant) {
        self.advance(now);
        if self.config.dialect == Dialect::GrblHal {
            self.rx.clear();
        }
        if self.state == State::Jog {
            self.end_jog(State::Idle, now);
        }
    }

    fn end_jog(&mut self, then: State, now: Instant) {
        if self.after_jog.is_none() {
            self.brake(now);
        }
        // A door that opens in the meantime is remembered.
        self.after_jog = Some(if self.after_jog == Some(State::Door) { State::Door } else { then });
    }

    fn brake(&mut self, now: Instant) {
        if let Some(motion) = &mut self.motion {
            *motion = motion.braking(now);
        }
    }

    fn stop_for_door(&mut self, now: Instant) {
        self.advance(now);
        match self.state {
            State::Home => return self.homing_interrupted(7, now),
            State::Run => self.brake(now),
            State::Jog => {
                self.send_line("[MSG:Check Door]");
                return self.end_jog(State::Door, now);
            }
            State::Idle | State::Hold => {}
            _ => return,
        }
        self.send_line("[MSG:Check Door]");
        (self.state, self.restored_at) = (State::Door, None);
    }

    fn resume(&mut self, now: Instant) {
        self.advance(now);
        if self.motion.is_some() {
            return;
        }
        match self.state {
            State::Hold => self.go_on(now),
            State::Door if !self.door_open && self.restored_at.is_none() => {
                self.restored_at = Some(now + DOOR_RESTORE);
            }
            _ => {}
        }
    }

    pub(super) fn end_restoring(&mut self, now: Instant) {
        if self.restored_at.is_some_and(|at| now >= at) {
            self.restored_at = None;
            self.go_on(now);
        }
    }

    fn go_on(&mut self, now: Instant) {
        match self.planned.front().copied() {
            Some(planned) => {
                self.state = State::Run;
                self.begin(planned.target_mm, planned.speed_mm_s, now);
            }
            None => self.state = State::Idle,
        }
    }
}
