//! What all connections share, and the door they come through.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};

use axum::extract::State;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::Value;
use store::Artifacts;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::task::JoinHandle;
use vision::LineDirection;

use crate::app::App;
use crate::config::Config;
use crate::jobs::{JobView, Jobs};
use crate::ledger::Ledger;
use crate::live::worker::Worker;
use crate::live::{self, LiveBus};
use crate::problem::{Problem, ProblemKind};
use crate::station::{SharedFrame, StationHandle, StationStatus};
use crate::ws::connection;
use crate::ws::encoder::{self, Slots};
use crate::ws::protocol::{MAX_CLIENT_MESSAGE_BYTES, MAX_SOCKETS, SUB_PROTOCOL};

/// What the streams are made of.
#[derive(Clone)]
pub struct Sources {
    /// Frames and points.
    pub live: LiveBus,
    /// The station's frames, for its clock.
    pub frames: watch::Receiver<Option<SharedFrame>>,
    /// The station's state.
    pub status: watch::Receiver<Arc<StationStatus>>,
    /// Progress of jobs.
    pub jobs: watch::Receiver<Option<JobView>>,
    /// Number of the newest event.
    pub events: watch::Receiver<i64>,
}

/// What all connections share. Clones are the same.
#[derive(Clone)]
pub struct Streams {
    pub(super) sources: Sources,
    pub(super) slots: Slots,
    pub(super) closing: watch::Sender<bool>,
    sockets: Arc<Semaphore>,
    _workers: Arc<Workers>,
    station_text: Arc<Mutex<Option<(Arc<StationStatus>, Arc<Value>)>>>,
}

/// What works behind the streams, and ends with the last clone of them.
#[derive(Default)]
struct Workers {
    threads: Vec<Worker>,
    tasks: Vec<JoinHandle<()>>,
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
        self.threads.clear();
    }
}

impl Streams {
    /// The live stream of a service: looks through the station's frames with the active calibration while somebody
    /// watches.
    ///
    /// # Errors
    /// If a thread cannot be started.
    pub fn open(
        config: &Config,
        station: &StationHandle,
        live: &LiveBus,
        jobs: &Jobs,
        ledger: &Ledger,
        artifacts: &Arc<dyn Artifacts>,
    ) -> io::Result<Self> {
        let line_direction = match config.projector.line_direction.as_str() {
            "columns" => LineDirection::Columns,
            _ => LineDirection::Rows,
        };
        let sources = Sources {
            live: live.clone(),
            frames: station.watch_frames(),
            status: station.watch_status(),
            jobs: jobs.watch_progress(),
            events: ledger.watch_events(),
        };
        let view = live::view::start(station, live.clone(), line_direction)?;
        let active = live::active::follow(ledger.clone(), artifacts.clone(), live.clone(), station.clone());
        Self::over(sources, line_direction, Workers { threads: vec![view], tasks: vec![tokio::spawn(active)] })
    }

    /// Over those sources alone.
    #[cfg(test)]
    pub fn bare(sources: Sources) -> io::Result<Self> {
        Self::over(sources, LineDirection::Rows, Workers::default())
    }

    fn over(sources: Sources, line_direction: LineDirection, mut workers: Workers) -> io::Result<Self> {
        let slots = Slots::default();
        workers.threads.push(encoder::start(sources.live.clone(), slots.clone(), line_direction)?);
        Ok(Self {
            sources,
            slots,
            closing: watch::Sender::new(false),
            sockets: Arc::new(Semaphore::new(MAX_SOCKETS)),
            _workers: Arc::new(workers),
            station_text: Arc::default(),
        })
    }

    /// Ends all connections with "going away"; new ones are refused.
    pub fn close(&self) {
        self.closing.send_replace(true);
    }

    /// Connections now.
    pub fn n_sockets(&self) -> usize {
        MAX_SOCKETS - self.sockets.available_permits()
    }

    /// Takes a connection in, or says why not.
    pub fn accept(&self, upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>) -> Response {
        match self.admitted(upgrade) {
            Err(problem) => refused(&problem),
            Ok((upgrade, place)) => {
                let streams = self.clone();
                upgrade
                    .on_upgrade(move |socket| async move {
                        connection::serve(socket, streams).await;
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
        let closing = *self.closing.borrow();
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
        let mut kept = self.station_text.lock().unwrap_or_else(PoisonError::into_inner);
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

fn refused(problem: &Problem) -> Response {
    let status = StatusCode::from_u16(problem.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
    let body = serde_json::to_string(problem).unwrap_or_default();
    let mut response = (status, [(header::CONTENT_TYPE, "application/problem+json")], body).into_response();
    if let Some(seconds) = problem.retry_after_s {
        response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds));
    }
    response
}

/// `GET /api/v1/stream`.
pub async fn stream(
    State(app): State<App>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    app.streams.accept(upgrade)
}
