//! The session's interface to the thread of a controller.

use std::time::{Duration, Instant};

use super::{Activity, Link, Session};
use crate::StageError;
use crate::lines::serial_controller::{Dialogue, StopBytes};

/// Longest sleep of the thread at rest; its queries are slower.
const RESTING_WAIT: Duration = Duration::from_millis(40);

/// Longest sleep while something moves or an answer is awaited.
const BUSY_WAIT: Duration = Duration::from_millis(5);

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
        self.fault.clone().map_or(Ok(()), Err)
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
            if let Some(line) = self.reader.take(byte, now) {
                self.line(&line, now);
            }
        }
    }

    fn tick(&mut self, now: Instant) {
        self.pass(now);
    }

    fn wait(&self) -> Duration {
        let resting = matches!(self.link, Link::Up) && self.activity == Activity::Rest && self.pending.is_empty();
        if resting { RESTING_WAIT } else { BUSY_WAIT }
    }

    fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    fn stop(&self) -> StopBytes {
        StopBytes { code: 0, bytes: self.stop_line() }
    }

    fn stop_sent(&mut self, _code: u8, now: Instant) {
        self.stop_begun(now);
    }

    fn shutdown_bytes(&self) -> Vec<u8> {
        self.stop_line()
    }

    fn wait_for(&mut self, ticket: u64) {
        (self.waited_for, self.refusal) = (Some(ticket), None);
    }

    fn is_answered_or_discarded(&self, ticket: u64) -> bool {
        !self.pending.iter().any(|pending| pending.ticket == ticket)
    }

    fn end_wait(&mut self) -> Option<StageError> {
        self.waited_for = None;
        self.refusal.take()
    }
}
