//! Rate limiting of one stream for one client, and its drop counts.

use tokio::time::Instant;

use live::pace::Pace;
use live::protocol::text::{DropCount, Stream};

/// Tracks one stream for one client. Messages of a stream are numbered without gaps.
#[derive(Debug, Clone)]
pub struct Meter {
    pace: Pace,
    /// Number of the newest message before the subscription, not counting the one sent at once.
    first: u64,
    /// Number of the last message sent.
    last: u64,
    /// Number of the newest message when the next one was due but the connection was busy.
    at_due: Option<u64>,
    sent: u64,
    by_rate: u64,
    too_slow: u64,
}

impl Meter {
    /// From `now` on at most `rate_hz` per second; `newest` exists already (0: none).
    pub fn new(rate_hz: f64, now: Instant, newest: u64) -> Self {
        let before = newest.saturating_sub(1);
        let pace = Pace::new(rate_hz, now);
        Self { pace, first: before, last: before, at_due: None, sent: 0, by_rate: 0, too_slow: 0 }
    }

    /// When the next message may be sent.
    pub fn opens(&self) -> Instant {
        self.pace.opens()
    }

    /// Whether a message is unsent.
    pub fn waits(&self, newest: u64) -> bool {
        newest > self.last
    }

    /// While the connection is busy: messages after the due time count as `too_slow`, not as `by_rate`.
    pub fn observe_busy(&mut self, now: Instant, newest: u64) {
        if self.at_due.is_none() && now >= self.opens() {
            self.at_due = Some(newest);
        }
    }

    /// Records that message `number`, the newest, is sent now.
    pub fn send(&mut self, now: Instant, number: u64) {
        let next = self.last + 1;
        let sendable = self.at_due.take().unwrap_or(number).clamp(next, number);
        self.by_rate += sendable - next;
        self.too_slow += number - sendable;
        self.sent += 1;
        self.last = number;
        self.pace.pass(now);
    }

    /// The counts so far.
    pub fn count(&self, stream: Stream) -> DropCount {
        DropCount {
            stream,
            offered: self.last - self.first,
            sent: self.sent,
            by_rate: self.by_rate,
            too_slow: self.too_slow,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::time::Duration;

    fn adds_up(meter: &Meter) -> DropCount {
        let count = meter.count(Stream::Image);
        assert_eq!(count.offered, count.sent + count.by_rate + count.too_slow);
        count
    }

    #[test]
    fn drops_by_rate_and_by_slowness_are_counted_separately() {
        let start = Instant::now();
        let mut meter = Meter::new(10.0, start, 0);
        meter.send(start, 1);
        // Idle until the next is due: 2 to 5 are skipped, 6 is sent.
        meter.send(start + Duration::from_millis(100), 6);
        assert_eq!((adds_up(&meter).by_rate, adds_up(&meter).too_slow), (4, 0));
        // Busy: at the due time 11 was the newest, 30 is sent in the end.
        meter.observe_busy(start + Duration::from_millis(120), 8);
        meter.observe_busy(start + Duration::from_millis(200), 11);
        meter.observe_busy(start + Duration::from_millis(400), 21);
        meter.send(start + Duration::from_millis(600), 30);
        let count = adds_up(&meter);
        assert_eq!((count.sent, count.by_rate, count.too_slow), (3, 4 + 4, 19));
    }

    #[test]
    fn a_busy_connection_without_new_messages_drops_nothing() {
        let start = Instant::now();
        let mut meter = Meter::new(1000.0, start, 5);
        assert!(meter.waits(5));
        meter.send(start, 5);
        assert!(!meter.waits(5));
        meter.observe_busy(start + Duration::from_secs(1), 5);
        meter.send(start + Duration::from_secs(2), 6);
        assert_eq!(
            adds_up(&meter),
            DropCount { stream: Stream::Image, offered: 2, sent: 2, by_rate: 0, too_slow: 0 }
        );
    }
}
