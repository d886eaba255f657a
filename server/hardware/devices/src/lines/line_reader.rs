//! Splits the bytes of a line into text lines.

use std::time::Instant;

use crate::params::SERIAL_LINE_BYTES;

/// Collects bytes until a text line ends.
#[derive(Debug, Default)]
pub struct LineReader {
    bytes: Vec<u8>,
    since: Option<Instant>,
}

/// A text line without its ending, and when its first byte was received.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceivedLine {
    pub text: String,
    pub began_at: Instant,
}

impl LineReader {
    /// Takes a byte received at `now`; returns the text line that it ends, if any. A line that is too long is cut and
    /// returned.
    pub fn take(&mut self, byte: u8, now: Instant) -> Option<ReceivedLine> {
        let began_at = *self.since.get_or_insert(now);
        if byte != b'\n' {
            self.bytes.push(byte);
            if self.bytes.len() <= SERIAL_LINE_BYTES {
                return None;
            }
        }
        self.since = None;
        let text = String::from_utf8_lossy(&std::mem::take(&mut self.bytes)).trim_end_matches('\r').to_owned();
        Some(ReceivedLine { text, began_at })
    }

    /// Discards a partial line.
    pub fn clear(&mut self) {
        (self.bytes, self.since) = (Vec::new(), None);
    }
}

/// Most characters shown of a foreign line.
const SHOWN_CHARS: usize = 40;

/// A line for display: short, and without control characters.
pub fn shortened(line: &str) -> String {
    let shown = |c: char| if c.is_control() { '·' } else { c };
    line.trim().chars().take(SHOWN_CHARS).map(shown).collect()
}
