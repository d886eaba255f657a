//! Counts received lines that are damaged or not part of the protocol.

use std::collections::VecDeque;
use std::time::Instant;

use crate::StageError;
use crate::params::{FOREIGN_LINES, FOREIGN_WINDOW};

/// The foreign lines of one link.
#[derive(Debug, Default)]
pub struct ForeignLines {
    counted_at: VecDeque<Instant>,
    /// The last line, if it was damaged.
    damaged: Option<String>,
}

impl ForeignLines {
    /// Counts a line that is damaged or was not expected. Returns whether there are so many that the link is given up.
    pub fn count(&mut self, now: Instant) -> bool {
        self.counted_at.retain(|at| now - *at < FOREIGN_WINDOW);
        self.counted_at.push_back(now);
        self.counted_at.len() >= FOREIGN_LINES
    }

    /// The last line is damaged; this is its beginning.
    pub fn last_is_damaged(&mut self, line: &str) {
        self.damaged = Some(line.to_owned());
    }

    /// The last line is part of the protocol.
    pub fn last_is_valid(&mut self) {
        self.damaged = None;
    }

    /// The last line, if it was damaged: then a missing answer is no silence.
    pub fn damaged(&self) -> Option<&str> {
        self.damaged.as_deref()
    }

    /// The fault of a command without a valid answer.
    pub fn unanswered(&self, command: &str, waited_ms: u64) -> StageError {
        match &self.damaged {
            Some(received) => StageError::Unreadable { received: received.clone() },
            None => StageError::NoResponse { command: command.to_owned(), waited_ms },
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn three_lines_within_a_second_are_too_many() {
        let start = Instant::now();
        let counted = |at_ms: [u64; 3]| {
            let mut lines = ForeignLines::default();
            at_ms.map(|at_ms| lines.count(start + Duration::from_millis(at_ms)))
        };
        assert_eq!(counted([0, 400, 999]), [false, false, true]);
        assert_eq!(counted([0, 400, 1000]), [false, false, false]);
    }

    #[test]
    fn a_command_after_a_damaged_line_is_not_answered_by_silence() {
        let silence = StageError::NoResponse { command: "?".to_owned(), waited_ms: 650 };
        let mut lines = ForeignLines::default();
        assert_eq!(lines.unanswered("?", 650), silence);
        lines.last_is_damaged("x");
        assert_eq!(lines.unanswered("?", 650), StageError::Unreadable { received: "x".to_owned() });
        lines.last_is_valid();
        assert_eq!(lines.unanswered("?", 650), silence);
    }
}
