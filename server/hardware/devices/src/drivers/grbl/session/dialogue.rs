//! The session as the thread of a controller drives it.

use std::time::{Duration, Instant};

use super::{Session, stop_bytes};
use crate::StageError;
use crate::drivers::grbl::fault::Fault;
use crate::drivers::grbl::protocol::{HOLD, RESET};
use crate::lines::serial_controller::{Dialogue, StopBytes};

impl Dialogue for Session {
    type Fault = Fault;

    fn wants_open(&self) -> bool {
        Session::wants_open(self)
    }

    fn is_down(&self) -> bool {
        Session::is_down(self)
    }

    fn opened_or_failed(&self) -> bool {
        Session::opened_or_failed(self)
    }

    fn sound(&self) -> Result<(), StageError> {
        Session::sound(self)
    }

    fn line_opened(&mut self, now: Instant) {
        Session::line_opened(self, now);
    }

    fn line_unopened(&mut self, reason: String) {
        Session::line_unopened(self, reason);
    }

    fn line_lost(&mut self, reason: String) {
        self.down(Fault::Gone { reason });
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
        Session::take_outgoing(self)
    }

    fn stop(&self) -> StopBytes {
        let code = self.stop_byte();
        StopBytes { code, bytes: stop_bytes(code).to_vec() }
    }

    fn stop_sent(&mut self, code: u8, now: Instant) {
        Session::stop_sent(self, code, now);
    }

    /// A reset answers by its banner whenever it is told of; a hold does not answer.
    fn retells(&self, code: u8) -> bool {
        code == HOLD
    }

    fn farewell(&self) -> Vec<u8> {
        vec![RESET]
    }

    fn wait_for(&mut self, ticket: u64) {
        Session::wait_for(self, ticket);
    }

    fn answered_or_gone(&self, ticket: u64) -> bool {
        Session::answered_or_gone(self, ticket)
    }

    fn end_wait(&mut self) -> Option<Fault> {
        Session::end_wait(self)
    }

    /// Real-time bytes go out singly, lines as a whole: USB adapters pass a lone byte on at once.
    fn piece(bytes: &[u8]) -> usize {
        let is_line_byte = |byte: u8| (b'$'..=b'Z').contains(&byte) && byte != b'?';
        if bytes.first().copied().is_some_and(is_line_byte) {
            bytes.iter().position(|&byte| byte == b'\n').map_or(bytes.len(), |at| at + 1)
        } else {
            1
        }
    }
}
