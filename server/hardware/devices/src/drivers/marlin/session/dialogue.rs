//! The session's interface to the thread of a controller.

use std::time::{Duration, Instant};

use super::{Activity, Device, HALT, Link, Session, halted};
use crate::StageError;
use crate::lines::serial_controller::{Dialogue, StopBytes};

/// Longest sleep of the thread at rest with the laser off; its queries are slower.
const RESTING_WAIT: Duration = Duration::from_millis(40);

/// Longest sleep while something moves, the laser is on or an answer is awaited.
const BUSY_WAIT: Duration = Duration::from_millis(5);

/// A stop in which no more is sent.
const RUN_OUT: u8 = 0;

/// A stop by a permanent halt: homing accepts nothing else.
const HALTED: u8 = 1;

impl Dialogue for Session {
    type Fault = StageError;

    fn should_be_open(&self) -> bool {
        self.should_be_open
    }

    fn is_down(&self) -> bool {
        matches!(self.link, Link::Down)
    }

    fn has_opened_or_failed(&self) -> bool {
        !self.should_be_open && !matches!(self.link, Link::Opening(_))
    }

    fn check_fault(&self) -> Result<(), StageError> {
        self.fault_of(Device::Stage).cloned().map_or(Ok(()), Err)
    }

    fn line_opened(&mut self, now: Instant) {
        self.begin_opening(now);
    }

    fn line_unopened(&mut self, reason: String) {
        self.should_be_open = false;
        self.down(StageError::Disconnected { reason });
    }

    fn line_lost(&mut self, reason: String) {
        self.down(StageError::Disconnected { reason });
    }

    fn received(&mut self, bytes: &[u8], now: Instant) {
        for &byte in bytes {
            self.received_at = Some(now);
            if let Some(line) = self.reader.take(byte, now) {
                self.line(&line, now);
            }
        }
        self.send_next(now);
    }

    fn tick(&mut self, now: Instant) {
        self.pass(now);
        self.send_next(now);
    }

    fn wait(&self) -> Duration {
        let resting = matches!(self.link, Link::Up)
            && self.activity == Activity::Rest
            && self.laser_lease.is_none()
            && self.pending.is_none();
        if resting { RESTING_WAIT } else { BUSY_WAIT }
    }

    fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    fn stop(&self) -> StopBytes {
        match self.activity {
            Activity::Homing { .. } => StopBytes { code: HALTED, bytes: HALT.to_vec() },
            _ => StopBytes { code: RUN_OUT, bytes: Vec::new() },
        }
    }

    fn stop_sent(&mut self, code: u8, now: Instant) {
        if !matches!(self.link, Link::Up) {
            return;
        }
        if code == HALTED {
            self.down(halted("it was stopped while homing, which halts it (M112)"));
            self.outgoing = HALT.to_vec();
            return;
        }
        self.turn_laser_off(now);
        self.begin_stop(None, now);
    }

    /// A stop that the thread has announced holds: nothing is sent after it.
    fn announces_again(&self, _code: u8) -> bool {
        false
    }

    fn shutdown_bytes(&self) -> Vec<u8> {
        match self.activity {
            Activity::Homing { .. } => HALT.to_vec(),
            _ if self.laser_lease.is_some() => b"\nM5\n".to_vec(),
            _ => Vec::new(),
        }
    }

    fn wait_for(&mut self, ticket: u64) {
        (self.waited_for, self.refusal) = (Some(ticket), None);
        self.send_next(crate::time::now());
    }

    fn is_answered_or_discarded(&self, ticket: u64) -> bool {
        let waits = self.queued.iter().any(|queued| queued.ticket == ticket);
        !waits && self.pending.as_ref().is_none_or(|pending| pending.queued.ticket != ticket)
    }

    fn end_wait(&mut self) -> Option<StageError> {
        self.waited_for = None;
        self.refusal.take()
    }
}
