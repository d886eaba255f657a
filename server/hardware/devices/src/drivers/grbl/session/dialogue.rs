//! The session's interface to the thread of a controller.

use std::time::{Duration, Instant};

use super::{Link, Session, stop_bytes};
use crate::StageError;
use crate::drivers::grbl::fault::{Device, Fault};
use crate::drivers::grbl::protocol::{HOLD, RESET};
use crate::lines::serial_controller::{Dialogue, StopBytes};

impl Dialogue for Session {
    type Fault = Fault;

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
        match self.fault_of(Device::Stage) {
            Some(fault) => Err(fault.for_stage()),
            None => Ok(()),
        }
    }

    fn line_opened(&mut self, now: Instant) {
        Session::line_opened(self, now);
    }

    fn line_unopened(&mut self, reason: String) {
        Session::line_unopened(self, reason);
    }

    fn line_lost(&mut self, reason: String) {
        self.down(Fault::Disconnected { reason });
    }

    fn received(&mut self, bytes: &[u8], now: Instant) {
        Session::received(self, bytes, now);
    }

    fn tick(&mut self, now: Instant) {
        Session::tick(self, now);
    }

    fn wait(&self) -> Duration {
        Session::wait(self)
    }

    fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    fn stop(&self) -> StopBytes {
        let code = self.stop_byte();
        StopBytes { code, bytes: stop_bytes(code).to_vec() }
    }

    fn stop_sent(&mut self, code: u8, now: Instant) {
        Session::stop_sent(self, code, now);
    }

    /// A reset is answered by its banner; a hold is not answered.
    fn announces_again(&self, code: u8) -> bool {
        code == HOLD
    }

    fn shutdown_bytes(&self) -> Vec<u8> {
        vec![RESET]
    }

    fn wait_for(&mut self, ticket: u64) {
        (self.waited_for, self.refusal) = (Some(ticket), None);
    }

    fn is_answered_or_discarded(&self, ticket: u64) -> bool {
        !self.pending.iter().any(|pending| pending.ticket == ticket)
    }

    fn end_wait(&mut self) -> Option<Fault> {
        self.waited_for = None;
        self.refusal.take()
    }

    /// Real-time bytes are sent singly, lines as a whole: USB adapters forward a single byte at once.
    fn chunk_len(bytes: &[u8]) -> usize {
        let is_line_byte = |byte: u8| (b'$'..=b'Z').contains(&byte) && byte != b'?';
        if bytes.first().copied().is_some_and(is_line_byte) {
            bytes.iter().position(|&byte| byte == b'\n').map_or(bytes.len(), |at| at + 1)
        } else {
            1
        }
    }
}
