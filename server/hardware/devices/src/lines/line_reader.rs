//! Bytes from a line, cut into its lines.

use std::time::Instant;

use crate::params::SERIAL_LINE_BYTES;

/// Collects bytes until a line ends.
#[derive(Debug, Default)]
pub struct LineReader {
    bytes: Vec<u8>,
    since: Option<Instant>,
}

/// A line without its end, and when its first byte came.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceivedLine {
    pub text: String,
    pub began_at: Instant,
}

impl LineReader {
    /// Takes a byte that came at `now`; the line, if this ends one. A line that grows too long is cut and handed out.
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

    /// Forgets what has come of a line.
    pub fn clear(&mut self) {
        (self.bytes, self.since) = (Vec::new(), None);
    }
}

/// Longest part of a foreign line that is shown.
const SHOWN_CHARS: usize = 40;

/// A line fit to be shown: short, and without control characters.
pub fn shortened(line: &str) -> String {
    let shown = |c: char| if c.is_control() { '·' } else { c };
    line.trim().chars().take(SHOWN_CHARS).map(shown).collect()
}
