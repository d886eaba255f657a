//! Images and profiles: only the newest of each counts.

use axum::extract::ws::Message;
use live::protocol::DEFAULT_RATE_HZ;
use live::protocol::text::{DropCount, Stream, Subscription};
use live::{Demand, StreamKind};
use tokio::sync::watch;
use tokio::time::Instant;

use crate::ws::encoder::Published;
use crate::ws::feeds::{Next, changed};
use crate::ws::meter::Meter;
use crate::ws::streams::Streams;

/// Images or profiles: only the newest counts.
pub struct SlotFeed {
    stream: Stream,
    slot: watch::Receiver<Published>,
    meter: Meter,
    _demand: Demand,
}

impl SlotFeed {
    /// A new subscription.
    pub fn new(wanted: &Subscription, streams: &Streams) -> Self {
        let kind = match wanted.stream {
            Stream::Image => StreamKind::Image { scale: wanted.scale.unwrap_or(1) },
            _ => StreamKind::Profile,
        };
        let rate_hz = wanted.max_rate_hz.unwrap_or(DEFAULT_RATE_HZ);
        let slot = streams.slots.of(kind).subscribe();
        let newest = slot.borrow().number;
        let demand = streams.sources.live.subscribe(kind, rate_hz);
        Self { stream: wanted.stream, slot, meter: Meter::new(rate_hz, Instant::now(), newest), _demand: demand }
    }

    /// The newest message, if it is unsent and the rate allows it.
    pub fn next(&mut self, now: Instant) -> Next {
        let newest = self.slot.borrow_and_update();
        if !self.meter.waits(newest.number) {
            return Next::Nothing;
        }
        if now < self.meter.opens() {
            return Next::At(self.meter.opens());
        }
        let before = self.meter.count(self.stream);
        self.meter.send(now, newest.number);
        note_lost(&before, &self.meter.count(self.stream));
        Next::Message(Message::Binary(newest.bytes.clone()))
    }

    /// Notes that the connection is busy with another message.
    pub fn observe_busy(&mut self, now: Instant) {
        let newest = self.slot.borrow().number;
        self.meter.observe_busy(now, newest);
    }

    /// When the next message may be sent.
    pub fn opens(&self) -> Instant {
        self.meter.opens()
    }

    /// The counts of sent and dropped messages.
    pub fn count(&self) -> DropCount {
        self.meter.count(self.stream)
    }

    /// Waits for something newer.
    pub async fn changed(&mut self) {
        changed(&mut self.slot).await;
    }
}

/// Adds the drops between two counts to the metrics of the service.
fn note_lost(before: &DropCount, after: &DropCount) {
    for (reason, lost) in
        [("by_rate", after.by_rate - before.by_rate), ("too_slow", after.too_slow - before.too_slow)]
    {
        if lost > 0 {
            let stream = after.stream.name();
            metrics::counter!("sheaf_stream_dropped_total", "stream" => stream, "reason" => reason)
                .increment(lost);
        }
    }
}
