//! The state shared by all connections, and the upgrade handler.

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

/// The sources of the streams.
#[derive(Clone)]
pub struct Sources {
    /// Frames and points.
    pub live: LiveBus,
    /// The station's frames, for their clock.
    pub frames: watch::Receiver<Option<SharedFrame>>,
    /// The station's state.
    pub status: watch::Receiver<Arc<StationStatus>>,
    /// Who is in control.
    pub control: watch::Receiver<Option<Lease>>,
    /// Progress of jobs.
    pub jobs: watch::Receiver<JobNews>,
    /// Number of the newest event.
    pub events: watch::Receiver<i64>,
}

/// A status and its JSON, serialised once for all connections.
type StationText = (Arc<StationStatus>, Arc<Value>);

/// The state shared by all connections. Clones share it.
#[derive(Clone)]
pub struct Streams {
    pub(super) sources: Sources,
    pub(super) slots: Slots,
    pub(super) closing: CancellationToken,
    sockets: Arc<Semaphore>,
    station_text: Arc<Mutex<Option<StationText>>>,
}

impl Streams {
    /// Streams from `sources` until `closing`, and starts the encoder thread; it ends when the worker is dropped.
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

    /// Number of open connections.
    pub fn n_sockets(&self) -> usize {
        MAX_SOCKETS - self.sockets.available_permits()
    }

    /// Accepts a connection, or says why not.
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
            Problem::new(ProblemKind::BadRequest, "this is not a WebSocket handshake")
                .because(rejection.body_text())
                .remedy("connect with a WebSocket client, see openapi/stream.md")
        })?;
        if !upgrade.requested_protocols().any(|name| name == SUB_PROTOCOL) {
            let problem = Problem::new(
                ProblemKind::BadRequest,
                format!("the sub-protocol {SUB_PROTOCOL} was not requested"),
            );
            return Err(Box::new(problem.remedy(format!("request {SUB_PROTOCOL} in Sec-WebSocket-Protocol"))));
        }
        let closing = self.closing.is_cancelled();
        let place = self.sockets.clone().try_acquire_owned().ok().filter(|_| !closing).ok_or_else(|| {
            Problem::new(
                ProblemKind::Unavailable,
                format!("the limit of {MAX_SOCKETS} live connections is reached"),
            )
            .remedy("close unused pages")
            .retry_after_s(5)
        })?;
        // Twice the limit: a message above the limit is closed with its own code, one far above it is not even read.
        let limit = 2 * MAX_CLIENT_MESSAGE_BYTES;
        Ok((upgrade.protocols([SUB_PROTOCOL]).max_message_size(limit).max_frame_size(limit), place))
    }

    /// The station's clock now; `None` before its first frame.
    pub(super) fn clock_ms(&self) -> Option<f64> {
        let frame = self.sources.frames.borrow().clone()?;
        Some(frame.captured_at_ns as f64 / 1e6 + frame.captured_at.elapsed().as_secs_f64() * 1e3)
    }

    /// A status as JSON, serialised once for all connections.
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
