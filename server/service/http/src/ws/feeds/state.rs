//! The state of the station, for one client.

use std::sync::Arc;

use app::lease::Lease;
use live::pace::Pace;
use live::protocol::DEFAULT_RATE_HZ;
use live::protocol::text::{ServerText, Subscription};
use serde_json::Value;
use station::StationStatus;
use tokio::sync::watch;
use tokio::time::Instant;

use crate::wire::hardware::control::ControlDto;
use crate::wire::hardware::station::StationDto;
use crate::ws::feeds::{Next, changed, text};
use crate::ws::streams::Streams;

/// The station: every change of state and of control at once, the rest at the requested rate.
pub struct StateFeed {
    status: watch::Receiver<Arc<StationStatus>>,
    control: watch::Receiver<Option<Lease>>,
    pace: Pace,
    seen: u64,
    sent: Option<(Arc<StationStatus>, Option<String>)>,
}

impl StateFeed {
    /// A new subscription.
    pub fn new(wanted: &Subscription, streams: &Streams) -> Self {
        let pace = Pace::new(wanted.max_rate_hz.unwrap_or(DEFAULT_RATE_HZ), Instant::now());
        let sources = &streams.sources;
        Self { status: sources.status.clone(), control: sources.control.clone(), pace, seen: 0, sent: None }
    }

    /// The newest status with the holder of control.
    pub fn next(&mut self, now: Instant, streams: &Streams) -> Next {
        let status = self.status.borrow_and_update().clone();
        let control = self.control.borrow_and_update().clone().filter(|lease| lease.ends_at > now.into_std());
        let holder = control.as_ref().map(|lease| lease.holder.clone());
        let same = |(sent, reported): &(Arc<StationStatus>, _)| Arc::ptr_eq(sent, &status) && *reported == holder;
        if self.sent.as_ref().is_some_and(same) {
            // A lease that is not renewed expires without an event on the channel.
            return control.map_or(Next::Nothing, |lease| Next::At(lease.ends_at.into()));
        }
        let changes: Vec<_> = status.state_history.after(self.seen).map(Into::into).collect();
        let urgent = !changes.is_empty() || self.sent.as_ref().is_some_and(|(_, reported)| *reported != holder);
        if !urgent && now < self.pace.opens() {
            return Next::At(self.pace.opens());
        }
        self.pace.pass(now);
        self.seen = status.state_history.newest();
        let mut station = (*streams.station_text(&status)).clone();
        station["control"] = serde_json::to_value(control.as_ref().map(ControlDto::from)).unwrap_or_default();
        self.sent = Some((status, holder));
        text(&ServerText::State { changes, station: &station })
    }

    /// Waits for something newer.
    pub async fn changed(&mut self) {
        tokio::select! {
            () = changed(&mut self.status) => {}
            () = changed(&mut self.control) => {}
        }
    }
}

/// The station as `GET /api/v1/station` returns it, without the holder of control.
pub fn station_json(status: &StationStatus) -> Value {
    serde_json::to_value(StationDto::new(status, None)).unwrap_or_default()
}
