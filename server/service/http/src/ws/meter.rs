//! Which messages of a stream one client gets, and what became of the others.

use tokio::time::Instant;

use live::pace::Pace;
use live::protocol::text::{DropCount, Stream};

/// Follows one stream for one client. Messages of a stream are numbered without gaps.
#[derive(Debug, Clone)]
pub struct Meter {
    pace: Pace,
    /// Number of the newest message when the subscription began, without the one that was there already.
    first: u64,
    /// Number of the message sent last.
    last: u64,
    /// Number of the newest message when the next one was due but the connection was busy.
    at_due: Option<u64>,
    sent: u64,
    by_rate: u64,
    too_slow: u64,
}

impl Meter {
    /// From `now` on at most `rate_hz` per second, `newest` being there already (0: nothing).
    pub fn new(rate_hz: f64, now: Instant, newest: u64) -> Self {
        let before = newest.saturating_sub(1);
        let pace = Pace::new(rate_hz, now);
        Self { pace, first: before, last: before, at_due: None, sent: 0, by_rate: 0, too_slow: 0 }
    }

    /// When the next message may go.
    pub fn opens(&self) -> Instant {
        self.pace.opens()
    }

    /// Whether there is something to send.
    pub fn waits(&self, newest: u64) -> bool {
        newest > self.last
    }

    /// The connection is busy: what comes from the due time on is lost to the client's slowness, not to its rate.
    pub fn observe_busy(&mut self, now: Instant, newest: u64) {
        if self.at_due.is_none() && now >= self.opens() {
            self.at_due = Some(newest);
        }
    }

    /// Message `number`, the newest, is sent now.
    pub fn send(&mut self, now: Instant, number: u64) {
        let next = self.last + 1;
        let sendable = self.at_due.take().unwrap_or(number).clamp(next, number);
        self.by_rate += sendable - next;
        self.too_slow += number - sendable;
        self.sent += 1;
        self.last = number;
        self.pace.pass(now);
    }

    /// What became of the messages so far.
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
    fn what_the_rate_left_out_and_what_slowness_left_out_are_told_apart() {
        let start = Instant::now();
        let mut meter = Meter::new(10.0, start, 0);
        meter.send(start, 1);
        // Idle until the next is due: 2 to 5 went by, 6 goes.
        meter.send(start + Duration::from_millis(100), 6);
        assert_eq!((adds_up(&meter).by_rate, adds_up(&meter).too_slow), (4, 0));
        // Busy: at the due time 11 was the newest, 30 goes in the end.
        meter.observe_busy(start + Duration::from_millis(120), 8);
        meter.observe_busy(start + Duration::from_millis(200), 11);
        meter.observe_busy(start + Duration::from_millis(400), 21);
        meter.send(start + Duration::from_millis(600), 30);
        let count = adds_up(&meter);
        assert_eq!((count.sent, count.by_rate, count.too_slow), (3, 4 + 4, 19));
    }

    #[test]
    fn busy_with_nothing_to_send_is_no_loss() {
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
