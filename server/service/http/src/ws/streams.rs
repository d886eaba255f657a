//! What all connections share, and the door they come through.

use parking_lot::Mutex;
use std::io;
use std::sync::Arc;

use axum::Extension;
use axum::extract::State;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::response::{IntoResponse, Response};
use live::LiveBus;
use live::protocol::{MAX_CLIENT_MESSAGE_BYTES, MAX_SOCKETS, SUB_PROTOCOL};
use live::worker::Worker;
use serde_json::Value;
use station::{SharedFrame, StationStatus};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use vision::LineDirection;

use crate::Http;
use crate::edge::{Peer, source};
use crate::problem::{Problem, ProblemKind};
use crate::ws::connection;
use crate::ws::encoder::{self, Slots};
use crate::ws::station::{Client, Station};
use app::jobs::JobNews;
use app::lease::Lease;
use tokio_util::sync::CancellationToken;

/// What the streams are made of.
#[derive(Clone)]
pub struct Sources {
    /// Frames and points.
    pub live: LiveBus,
    /// The station's frames, for its clock.
    pub frames: watch::Receiver<Option<SharedFrame>>,
    /// The station's state.
    pub status: watch::Receiver<Arc<StationStatus>>,
    /// Who commands.
    pub control: watch::Receiver<Option<Lease>>,
    /// Progress of jobs.
    pub jobs: watch::Receiver<JobNews>,
    /// Number of the newest event.
    pub events: watch::Receiver<i64>,
}

/// A status and its JSON, made once for all.
type StationText = (Arc<StationStatus>, Arc<Value>);

/// What all connections share. Clones are the same.
#[derive(Clone)]
pub struct Streams {
    pub(super) sources: Sources,
    pub(super) slots: Slots,
    pub(super) closing: CancellationToken,
    sockets: Arc<Semaphore>,
    station_text: Arc<Mutex<Option<StationText>>>,
}

impl Streams {
    /// Over those sources until `closing`, with the thread that encodes; it ends when the worker is dropped.
    pub fn start(
        sources: Sources,
        line_direction: LineDirection,
        closing: CancellationToken,
    ) -> io::Result<(Self, Worker)> {
        let slots = Slots::default();
        let worker = encoder::start(sources.live.clone(), slots.clone(), line_direction)?;
        let streams = Self {
            sources,
            slots,
            closing,
            sockets: Arc::new(Semaphore::new(MAX_SOCKETS)),
            station_text: Arc::default(),
        };
        Ok((streams, worker))
    }

    /// Connections now.
    pub fn n_sockets(&self) -> usize {
        MAX_SOCKETS - self.sockets.available_permits()
    }

    /// Takes a connection in, or says why not.
    pub fn accept(
        &self,
        upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
        station: impl Station + 'static,
    ) -> Response {
        match self.admitted(upgrade) {
            Err(problem) => problem.into_response(),
            Ok((upgrade, place)) => {
                let streams = self.clone();
                upgrade
                    .on_upgrade(move |socket| async move {
                        connection::serve(socket, streams, &station).await;
                        drop(place);
                    })
                    .into_response()
            }
        }
    }

    fn admitted(
        &self,
        upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
    ) -> Result<(WebSocketUpgrade, OwnedSemaphorePermit), Box<Problem>> {
        let upgrade = upgrade.map_err(|rejection| {
            Problem::new(ProblemKind::BadRequest, "this is not the beginning of a WebSocket")
                .because(rejection.body_text())
                .remedy("connect with a WebSocket client, see openapi/stream.md")
        })?;
        if !upgrade.requested_protocols().any(|name| name == SUB_PROTOCOL) {
            let problem = Problem::new(
                ProblemKind::BadRequest,
                format!("the sub-protocol {SUB_PROTOCOL} was not asked for"),
            );
            return Err(Box::new(problem.remedy(format!("ask for {SUB_PROTOCOL} in Sec-WebSocket-Protocol"))));
        }
        let closing = self.closing.is_cancelled();
        let place = self.sockets.clone().try_acquire_owned().ok().filter(|_| !closing).ok_or_else(|| {
            Problem::new(ProblemKind::Unavailable, format!("{MAX_SOCKETS} viewers are connected already"))
                .remedy("close pages that are not looked at")
                .retry_after_s(5)
        })?;
        // Twice the limit: what is above it is closed with its own code, what is far above it is not even read.
        let limit = 2 * MAX_CLIENT_MESSAGE_BYTES;
        Ok((upgrade.protocols([SUB_PROTOCOL]).max_message_size(limit).max_frame_size(limit), place))
    }

    /// The station's clock now; `None` before its first frame.
    pub(super) fn clock_ms(&self) -> Option<f64> {
        let frame = self.sources.frames.borrow().clone()?;
        Some(frame.captured_at_ns as f64 / 1e6 + frame.captured_at.elapsed().as_secs_f64() * 1e3)
    }

    /// A status as JSON, made once for all connections.
    pub(super) fn station_text(&self, status: &Arc<StationStatus>) -> Arc<Value> {
        let mut kept = self.station_text.lock();
        if let Some((known, text)) = &*kept
            && Arc::ptr_eq(known, status)
        {
            return text.clone();
        }
        let text = Arc::new(crate::ws::feeds::station_json(status));
        *kept = Some((status.clone(), text.clone()));
        text
    }
}

/// `GET /api/v1/stream`.
pub async fn stream(
    State(http): State<Http>,
    peer: Option<Extension<Peer>>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    let client = Client::new(http.app, source(peer.as_deref()));
    http.streams.accept(upgrade, client)
}
