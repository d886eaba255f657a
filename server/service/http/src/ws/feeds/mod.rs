//! The subscriptions of one client, and the next message of each.

mod points;
mod records;
mod slot;
mod state;

use axum::extract::ws::Message;
use live::protocol::text::{DropCount, ServerText, Stream, Subscription};
use tokio::sync::watch;
use tokio::time::{Duration, Instant};

use crate::ws::streams::Streams;

pub use points::PointsFeed;
pub use records::{EventsFeed, JobsFeed};
pub use slot::SlotFeed;
pub use state::{StateFeed, station_json};

/// The next message of a stream.
pub enum Next {
    /// A message to send now.
    Message(Message),
    /// A message, but not before the given time.
    At(Instant),
    /// Nothing.
    Nothing,
}

fn text(text: &ServerText) -> Next {
    Next::Message(Message::text(text.to_json()))
}

/// Waits for a newer value; pending forever if the source is closed.
async fn changed<T>(receiver: &mut watch::Receiver<T>) {
    if receiver.changed().await.is_err() {
        std::future::pending::<()>().await;
    }
}

/// All streams of one client.
#[derive(Default)]
pub struct Feeds {
    image: Option<SlotFeed>,
    profile: Option<SlotFeed>,
    points: Option<PointsFeed>,
    state: Option<StateFeed>,
    jobs: Option<JobsFeed>,
    events: Option<EventsFeed>,
    subscriptions: Vec<Subscription>,
    turn: usize,
    reported: Option<(Instant, Vec<DropCount>)>,
}

/// Minimum interval between two `dropped` reports.
const REPORT_EVERY: Duration = Duration::from_secs(1);

impl Feeds {
    /// Subscribes; replaces an existing subscription.
    pub fn subscribe(&mut self, wanted: Subscription, streams: &Streams) {
        match wanted.stream {
            Stream::Image => self.image = Some(SlotFeed::new(&wanted, streams)),
            Stream::Profile => self.profile = Some(SlotFeed::new(&wanted, streams)),
            Stream::Points => self.points = Some(PointsFeed::new(&wanted, &streams.sources.live)),
            Stream::State => self.state = Some(StateFeed::new(&wanted, streams)),
            Stream::Jobs => self.jobs = Some(JobsFeed::new(&wanted, streams)),
            Stream::Events => self.events = Some(EventsFeed::new(streams)),
        }
        self.subscriptions.retain(|known| known.stream != wanted.stream);
        self.subscriptions.push(wanted);
    }

    /// Ends a subscription.
    pub fn unsubscribe(&mut self, stream: Stream) {
        match stream {
            Stream::Image => self.image = None,
            Stream::Profile => self.profile = None,
            Stream::Points => self.points = None,
            Stream::State => self.state = None,
            Stream::Jobs => self.jobs = None,
            Stream::Events => self.events = None,
        }
        self.subscriptions.retain(|known| known.stream != stream);
    }

    /// Whether the client is a viewer of the camera.
    pub fn shows_frames(&self) -> bool {
        self.image.is_some() || self.profile.is_some()
    }

    /// All subscriptions.
    pub fn subscriptions(&self) -> Vec<Subscription> {
        self.subscriptions.clone()
    }

    /// The next message: texts first, then images, profiles and points in turn, so that none starves the others.
    pub fn next(&mut self, now: Instant, streams: &Streams) -> Next {
        let mut soonest: Option<Instant> = None;
        let mut pass = |next: Next| match next {
            Next::Message(message) => Some(message),
            Next::At(at) => {
                soonest = Some(soonest.map_or(at, |soonest| soonest.min(at)));
                None
            }
            Next::Nothing => None,
        };
        let words = (self.state.as_mut().and_then(|feed| pass(feed.next(now, streams))))
            .or_else(|| self.jobs.as_mut().and_then(|feed| pass(feed.next(now))))
            .or_else(|| self.events.as_mut().and_then(|feed| pass(feed.next())));
        if let Some(message) = words {
            return Next::Message(message);
        }
        for _ in 0..3 {
            self.turn = (self.turn + 1) % 3;
            let next = match self.turn {
                0 => self.points.as_mut().map(PointsFeed::next),
                1 => self.profile.as_mut().map(|feed| feed.next(now)),
                _ => self.image.as_mut().map(|feed| feed.next(now)),
            };
            if let Some(message) = next.and_then(&mut pass) {
                return Next::Message(message);
            }
        }
        let report = self.report(now);
        if let Some(message) = pass(report) {
            return Next::Message(message);
        }
        soonest.map_or(Next::Nothing, Next::At)
    }

    /// The drop counts, if they have grown since the last report.
    fn report(&mut self, now: Instant) -> Next {
        let counts: Vec<DropCount> =
            [&self.image, &self.profile].into_iter().flatten().map(SlotFeed::count).collect();
        let lost = |counts: &[DropCount]| -> Vec<_> {
            counts.iter().map(|count| (count.stream, count.by_rate, count.too_slow)).collect()
        };
        let known = self.reported.as_ref().map_or(Vec::new(), |(_, reported)| lost(reported));
        let nothing_lost = counts.iter().all(|count| count.by_rate + count.too_slow == 0);
        if nothing_lost || lost(&counts) == known {
            return Next::Nothing;
        }
        let due = self.reported.as_ref().map(|(at, _)| *at + REPORT_EVERY);
        if let Some(due) = due.filter(|due| now < *due) {
            return Next::At(due);
        }
        let message = text(&ServerText::Dropped { streams: counts.clone() });
        self.reported = Some((now, counts));
        message
    }

    /// While the connection is busy: notes for each stream which message was newest when one was due. Returns the next due
    /// time.
    pub fn observe_busy(&mut self, now: Instant) -> Option<Instant> {
        let feeds = [&mut self.image, &mut self.profile].into_iter().flatten();
        feeds
            .filter_map(|feed| {
                let opens = feed.opens();
                feed.observe_busy(now);
                (opens > now).then_some(opens)
            })
            .min()
    }

    /// Waits for something new for this client.
    pub async fn changed(&mut self) {
        macro_rules! either {
            ($($feed:ident),*) => {
                tokio::select! {
                    $(() = async {
                        match &mut self.$feed {
                            Some(feed) => feed.changed().await,
                            None => std::future::pending().await,
                        }
                    } => {})*
                }
            };
        }
        either!(image, profile, points, state, jobs, events);
    }
}
