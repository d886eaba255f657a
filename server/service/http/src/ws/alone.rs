//! The live stream without a station, for load tests.

use std::io;
use std::sync::Arc;
use std::time::Instant;

use app::jobs::JobNews;
use axum::Router;
use axum::extract::State;
use axum::routing::any;
use futures_util::future::BoxFuture;
use live::LiveBus;
use station::{MachineState, first_status};
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use vision::LineDirection;

use crate::wire::hardware::station::{MachineStateDto, StopResultDto};
use crate::ws::station::Station;
use crate::ws::{Sources, Streams};

/// Serves the bus to every client through the service's own accept loop, handshake and connections.
///
/// # Errors
/// If a thread cannot be started.
pub fn serve_stream(listener: TcpListener, live: LiveBus) -> io::Result<impl Future<Output = ()> + Send> {
    let sources = Sources {
        live,
        frames: watch::channel(None).1,
        status: watch::channel(Arc::new(first_status(None, MachineState::Preoperational))).1,
        control: watch::channel(None).1,
        jobs: watch::channel(JobNews::default()).1,
        events: watch::channel(0).1,
    };
    let closing = CancellationToken::new();
    let (streams, encoder) = Streams::start(sources, LineDirection::Rows, closing.clone())?;
    let accept = any(|State(streams): State<Streams>, upgrade| async move { streams.accept(upgrade, NoStation) });
    let router = Router::new().route("/api/v1/stream", accept).with_state(streams);
    Ok(async move {
        crate::edge::serve(listener, router, closing, TaskTracker::new()).await;
        drop(encoder);
    })
}

pub(super) struct NoStation;

impl Station for NoStation {
    fn note_viewer(&self, _at: Instant) {}

    fn stop(&self, _actor: Option<&str>) -> BoxFuture<'static, StopResultDto> {
        let nothing = StopResultDto { acknowledged: false, state: MachineStateDto::Preoperational, detail: None };
        Box::pin(std::future::ready(nothing))
    }
}
