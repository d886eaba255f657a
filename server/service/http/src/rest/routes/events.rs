//! Events: as a list, and as a stream that resumes where the client left off.

use crate::Http;
use std::collections::{HashSet, VecDeque};
use std::convert::Infallible;

use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse as _, Response};
use futures_util::stream::{Stream, unfold};
use serde::Deserialize;
use store::{DamagedRow, EventRecord, Listed};
use tokio::sync::watch;
use tokio::time::Instant;
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::limits::{SSE_KEEP_ALIVE, SSE_PROGRESS_PERIOD};
use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::header_text;
use crate::rest::extract::ApiQuery;
use crate::wire::events::{EventDto, EventListDto};
use crate::wire::job::jobs::JobDto;
use crate::wire::paging::{DamagedRecordDto, page};
use app::App;
use app::jobs::JobNews;

const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");

/// Number of events read from the store at a time while a client catches up.
const CATCH_UP: u32 = 200;

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new().routes(routes!(list_events))
}

/// Selects events.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct EventsQuery {
    /// Only events after this one. Default: a list starts with the oldest event, a stream with the next one.
    #[param(minimum = 0)]
    after: Option<i64>,
    /// Maximum number of events, 1 to 200; default 50.
    #[param(minimum = 1, maximum = 200)]
    limit: Option<u32>,
}

/// Lists or streams events, oldest first.
///
/// With `Accept: text/event-stream` the response is an endless stream. Durable events have an `id`; a client that
/// reconnects sends the last one as `Last-Event-ID` and misses none. Job progress is sent as `job.progress` without
/// `id`; an event that is damaged in the database as `event.damaged` without `id`.
#[utoipa::path(
    get, path = "/events", tag = "events",
    params(EventsQuery, ("Last-Event-ID" = Option<String>, Header, description = "Id of the last event received")),
    responses((status = 200, content((EventListDto = "application/json"), (String = "text/event-stream"))))
)]
async fn list_events(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<EventsQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let accept = header_text(&headers, &header::ACCEPT)?.unwrap_or_default();
    let seen = match header_text(&headers, &LAST_EVENT_ID)? {
        Some(text) => Some(sequence(&text)?),
        None => query.after,
    };
    if accept.contains("text/event-stream") {
        let after = match seen {
            Some(after) => after,
            None => app.catalogue.read().last_event_seq().await?,
        };
        let keep_alive = KeepAlive::new().interval(SSE_KEEP_ALIVE);
        return Ok(Sse::new(follow(Follower::new(app, after))).keep_alive(keep_alive).into_response());
    }
    let limit = page(None, query.limit)?.limit;
    let after = seen.unwrap_or(0);
    let Listed { records, damaged, .. } = app.catalogue.read().events_after(after, limit).await?;
    let last = records.last().map_or(after, |record| record.seq);
    let next = format!("/api/v1/events?after={last}&limit={limit}");
    let damaged = damaged.into_iter().map(DamagedRecordDto::from).collect();
    let items = records.into_iter().map(EventDto::from).collect();
    Ok(Json(EventListDto { items, damaged, next }).into_response())
}

fn sequence(text: &str) -> Result<i64, Problem> {
    text.trim().parse().ok().filter(|seq| *seq >= 0).ok_or_else(|| {
        Problem::new(ProblemKind::BadRequest, "Last-Event-ID is not the id of an event")
            .at("Last-Event-ID")
            .remedy("send the id of the last event received, or omit the header")
    })
}

/// A client of the event stream.
struct Follower {
    app: App,
    seen: i64,
    waiting: VecDeque<EventRecord>,
    /// Damaged events: still to be sent, and already sent.
    damaged: VecDeque<DamagedRow>,
    named: HashSet<String>,
    newest: watch::Receiver<i64>,
    progress: watch::Receiver<JobNews>,
    /// Number of the last progress message sent.
    last_progress: u64,
    next_progress: Instant,
}

impl Follower {
    fn new(app: App, seen: i64) -> Self {
        let (newest, progress) = (app.catalogue.watch_events(), app.jobs.watch_progress());
        let last_progress = progress.borrow().last();
        let (waiting, damaged, named) = (VecDeque::new(), VecDeque::new(), HashSet::new());
        Self { app, seen, waiting, damaged, named, newest, progress, last_progress, next_progress: Instant::now() }
    }

    /// The next message; `None` ends the stream.
    async fn next(&mut self) -> Option<Event> {
        loop {
            if let Some(row) = self.damaged.pop_front() {
                return Event::default().event("event.damaged").json_data(DamagedRecordDto::from(row)).ok();
            }
            if let Some(record) = self.waiting.pop_front() {
                self.seen = record.seq;
                return durable(record);
            }
            self.newest.mark_unchanged();
            // A store error ends the stream; the client reconnects and resumes where it was.
            let Listed { records, damaged, .. } =
                self.app.catalogue.read().events_after(self.seen, CATCH_UP).await.ok()?;
            self.waiting = records.into();
            self.damaged = damaged.into_iter().filter(|row| self.named.insert(row.id.clone())).collect();
            if !(self.waiting.is_empty() && self.damaged.is_empty()) {
                continue;
            }
            tokio::select! {
                () = self.app.closing.cancelled() => return None,
                changed = self.newest.changed() => changed.ok()?,
                event = progress(&mut self.progress, &mut self.last_progress, self.next_progress) => {
                    self.next_progress = Instant::now() + SSE_PROGRESS_PERIOD;
                    return event;
                }
            }
        }
    }
}

async fn progress(
    jobs: &mut watch::Receiver<JobNews>,
    last_progress: &mut u64,
    not_before: Instant,
) -> Option<Event> {
    tokio::time::sleep_until(not_before).await;
    let seen = *last_progress;
    let news = jobs.wait_for(|news| news.after(seen).is_some()).await.ok()?;
    let (number, view) = news.after(seen)?;
    *last_progress = number;
    Event::default().event("job.progress").json_data(JobDto::from(view.clone())).ok()
}

fn durable(record: EventRecord) -> Option<Event> {
    let (id, kind) = (record.seq.to_string(), record.kind.clone());
    Event::default().id(id).event(kind).json_data(EventDto::from(record)).ok()
}

fn follow(follower: Follower) -> impl Stream<Item = Result<Event, Infallible>> {
    unfold(follower, |mut follower| async move {
        let event = follower.next().await?;
        Some((Ok(event), follower))
    })
}
