//! The streams one client has subscribed to, and what comes next of each.

use std::sync::Arc;

use axum::extract::ws::Message;
use live::pace::Pace;
use live::protocol::DEFAULT_RATE_HZ;
use live::protocol::text::{DropCount, ServerText, Stream, Subscription};
use live::{LiveBus, PointLog, PointsSeen, Sight, Wish};
use serde_json::Value;
use station::StationStatus;
use tokio::sync::watch;
use tokio::time::{Duration, Instant};

use crate::wire::hardware::control::ControlDto;
use crate::wire::hardware::station::StationDto;
use crate::wire::job::jobs::JobDto;
use crate::ws::encoder::Published;
use crate::ws::meter::Meter;
use crate::ws::streams::Streams;
use app::jobs::{JobNews, JobView};
use app::lease::Lease;

/// What a stream has for its client.
pub enum Next {
    /// A message, to be sent now.
    Message(Message),
    /// Something, but not before that moment.
    At(Instant),
    /// Nothing.
    Nothing,
}

fn text(text: &ServerText) -> Next {
    Next::Message(Message::text(text.to_json()))
}

/// Pictures or profiles: only the newest counts.
pub struct SlotFeed {
    stream: Stream,
    slot: watch::Receiver<Published>,
    meter: Meter,
    _wish: Wish,
}

impl SlotFeed {
    /// As subscribed.
    pub fn new(wanted: &Subscription, streams: &Streams) -> Self {
        let sight = match wanted.stream {
            Stream::Image => Sight::Image { scale: wanted.scale.unwrap_or(1) },
            _ => Sight::Profile,
        };
        let rate_hz = wanted.max_rate_hz.unwrap_or(DEFAULT_RATE_HZ);
        let slot = streams.slots.of(sight).subscribe();
        let newest = slot.borrow().number;
        let wish = streams.sources.live.want(sight, rate_hz);
        Self { stream: wanted.stream, slot, meter: Meter::new(rate_hz, Instant::now(), newest), _wish: wish }
    }

    /// The newest message, if the client has not got it and the rate allows.
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

    /// The connection is busy with another message.
    pub fn observe_busy(&mut self, now: Instant) {
        let newest = self.slot.borrow().number;
        self.meter.observe_busy(now, newest);
    }

    /// When the next message may go.
    pub fn opens(&self) -> Instant {
        self.meter.opens()
    }

    /// What became of the messages.
    pub fn count(&self) -> DropCount {
        self.meter.count(self.stream)
    }

    /// Something newer came.
    pub async fn changed(&mut self) {
        changed(&mut self.slot).await;
    }
}

/// Adds what was lost between two counts to the figures of the service.
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

/// The station: every change of state, who commands, and the rest as often as wanted.
pub struct StateFeed {
    status: watch::Receiver<Arc<StationStatus>>,
    control: watch::Receiver<Option<Lease>>,
    pace: Pace,
    seen: u64,
    sent: Option<(Arc<StationStatus>, Option<String>)>,
}

impl StateFeed {
    /// As subscribed.
    pub fn new(wanted: &Subscription, streams: &Streams) -> Self {
        let pace = Pace::new(wanted.max_rate_hz.unwrap_or(DEFAULT_RATE_HZ), Instant::now());
        let sources = &streams.sources;
        Self { status: sources.status.clone(), control: sources.control.clone(), pace, seen: 0, sent: None }
    }

    /// The newest status with who commands.
    pub fn next(&mut self, now: Instant, streams: &Streams) -> Next {
        let status = self.status.borrow_and_update().clone();
        let control = self.control.borrow_and_update().clone().filter(|lease| lease.ends_at > now.into_std());
        let holder = control.as_ref().map(|lease| lease.holder.clone());
        let same = |(sent, told): &(Arc<StationStatus>, _)| Arc::ptr_eq(sent, &status) && *told == holder;
        if self.sent.as_ref().is_some_and(same) {
            // A lease that nobody renews ends without a word.
            return control.map_or(Next::Nothing, |lease| Next::At(lease.ends_at.into()));
        }
        let changes: Vec<_> = status.state_history.after(self.seen).map(Into::into).collect();
        let urgent = !changes.is_empty() || self.sent.as_ref().is_some_and(|(_, told)| *told != holder);
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

    /// Something newer came.
    pub async fn changed(&mut self) {
        tokio::select! {
            () = changed(&mut self.status) => {}
            () = changed(&mut self.control) => {}
        }
    }
}

/// Progress of jobs: of each the newest counts.
pub struct JobsFeed {
    jobs: watch::Receiver<JobNews>,
    pace: Pace,
    /// Number of the last word that was sent.
    sent: u64,
}

impl JobsFeed {
    /// As subscribed: what is known of jobs at work comes first.
    pub fn new(wanted: &Subscription, streams: &Streams) -> Self {
        let pace = Pace::new(wanted.max_rate_hz.unwrap_or(DEFAULT_RATE_HZ), Instant::now());
        Self { jobs: streams.sources.jobs.clone(), pace, sent: 0 }
    }

    /// The progress that waits longest.
    pub fn next(&mut self, now: Instant) -> Next {
        let news = self.jobs.borrow_and_update();
        let Some((number, view)) = news.after(self.sent) else { return Next::Nothing };
        if now < self.pace.opens() {
            return Next::At(self.pace.opens());
        }
        self.pace.pass(now);
        self.sent = number;
        text(&ServerText::Job { job: &job_json(view) })
    }

    /// Something newer came.
    pub async fn changed(&mut self) {
        changed(&mut self.jobs).await;
    }
}

/// The number of the newest event.
pub struct EventsFeed {
    events: watch::Receiver<i64>,
    sent: Option<i64>,
}

impl EventsFeed {
    /// As subscribed.
    pub fn new(streams: &Streams) -> Self {
        Self { events: streams.sources.events.clone(), sent: None }
    }

    /// The newest number, if it was not sent.
    pub fn next(&mut self) -> Next {
        let seq = *self.events.borrow_and_update();
        if self.sent.replace(seq) == Some(seq) {
            return Next::Nothing;
        }
        text(&ServerText::Event { seq })
    }

    /// Something newer came.
    pub async fn changed(&mut self) {
        changed(&mut self.events).await;
    }
}

/// The points of a scan: every block, in order, at the client's own speed.
pub struct PointsFeed {
    seen: watch::Receiver<PointsSeen>,
    log: Option<Arc<PointLog>>,
    next_block: u32,
    begun: bool,
    ended: bool,
}

impl PointsFeed {
    /// From a block on, or from now on.
    pub fn new(wanted: &Subscription, live: &LiveBus) -> Self {
        let seen = live.watch_points();
        let (log, n_blocks) = {
            let now = seen.borrow();
            (now.log.clone(), now.n_blocks)
        };
        let next_block = wanted.from_block.map_or(n_blocks, |block| block.min(n_blocks));
        Self { seen, log, next_block, begun: false, ended: false }
    }

    /// The next block, or that a scan began or ended.
    pub fn next(&mut self) -> Next {
        let seen = self.seen.borrow_and_update().clone();
        let same = |log: &Arc<PointLog>| seen.log.as_ref().is_some_and(|newest| Arc::ptr_eq(newest, log));
        if let Some(log) = &self.log {
            let over = !(same(log) && seen.running);
            let first = !std::mem::replace(&mut self.begun, true);
            if first && (!over || self.next_block < log.n_blocks()) {
                return said(log, true, self.next_block);
            }
            if let Some(block) = log.block(self.next_block) {
                self.next_block += 1;
                return Next::Message(Message::Binary(block));
            }
            if over && !std::mem::replace(&mut self.ended, true) {
                return said(log, false, self.next_block);
            }
            if same(log) {
                return Next::Nothing;
            }
        }
        if seen.log.is_none() {
            return Next::Nothing;
        }
        (self.log, self.next_block, self.begun, self.ended) = (seen.log, 0, false, false);
        self.next()
    }

    /// Something newer came.
    pub async fn changed(&mut self) {
        changed(&mut self.seen).await;
    }
}

fn said(log: &PointLog, running: bool, next_block: u32) -> Next {
    text(&ServerText::Scan { scan_id: log.scan_id(), running, n_blocks: log.n_blocks(), next_block })
}

/// Waits for a newer value; forever if none can come.
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

/// Time between two reports of what was left out.
const REPORT_EVERY: Duration = Duration::from_secs(1);

impl Feeds {
    /// Subscribes; what was subscribed to before is replaced.
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

    /// Whether the client is shown what the camera sees.
    pub fn shows_frames(&self) -> bool {
        self.image.is_some() || self.profile.is_some()
    }

    /// Everything that is subscribed to.
    pub fn subscriptions(&self) -> Vec<Subscription> {
        self.subscriptions.clone()
    }

    /// What goes out next: first words, then by turns pictures, profiles and points, so that none starves another.
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

    /// What was left out, if more was than told before.
    fn report(&mut self, now: Instant) -> Next {
        let counts: Vec<DropCount> =
            [&self.image, &self.profile].into_iter().flatten().map(SlotFeed::count).collect();
        let lost = |counts: &[DropCount]| -> Vec<_> {
            counts.iter().map(|count| (count.stream, count.by_rate, count.too_slow)).collect()
        };
        let known = self.reported.as_ref().map_or(Vec::new(), |(_, told)| lost(told));
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

    /// The connection is busy: notes for each stream what is newest when its time comes. Returns the next such time.
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

    /// Something came for this client.
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

/// The station as `GET /api/v1/station` tells it, still without who commands.
pub fn station_json(status: &StationStatus) -> Value {
    serde_json::to_value(StationDto::new(status, None)).unwrap_or_default()
}

/// A job as `GET /api/v1/jobs/{id}` tells it.
fn job_json(view: &JobView) -> Value {
    serde_json::to_value(JobDto::from(view.clone())).unwrap_or_default()
}
