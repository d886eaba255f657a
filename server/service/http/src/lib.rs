//! The HTTP interface for browsers and programs: REST, the live stream over WebSocket, and the embedded page.
//!
//! Requests become the typed input of a use case; its result or error becomes the response. Wire types live in `wire`,
//! the table of problems and status codes in `problem`. Rules that another interface would need as well belong in
//! `app`; devices and SQL do not appear here.
#![allow(clippy::result_large_err, reason = "a problem ends the request, so its size does not matter")]

mod edge;
mod limits;
mod page;
mod problem;
mod rest;
mod router;
mod typed_json;
mod wire;
mod ws;

use std::sync::Arc;

use app::App;
use axum::extract::FromRef;
use live::worker::Worker;
use metrics_exporter_prometheus::{PrometheusBuilder, PrometheusHandle};
use pipeline::{Failure, FailureKind};
use tokio::net::TcpListener;
use tokio::task::JoinHandle;

pub use rest::openapi::{document_json, events_document};
pub use ws::serve_stream;

use ws::{Sources, Streams};

/// Which hosts and origins may use the service, beyond this machine's own names.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct HttpConfig {
    /// The address this machine listens on.
    pub listen_ip: Option<std::net::IpAddr>,
    /// Host names that clients may use (`Host`), without port.
    pub allowed_hosts: Vec<String>,
    /// Origins of other pages that may use it (`Origin`): `https://line3.example`.
    pub allowed_origins: Vec<String>,
    /// Whether a trusted reverse proxy in front handles users and TLS; if not, only this machine is served.
    pub trusted_proxy: bool,
}

/// The HTTP server and the state its connections share.
#[derive(Clone)]
pub struct Http {
    /// The use cases.
    pub app: App,
    config: Arc<HttpConfig>,
    streams: Streams,
    figures: PrometheusHandle,
    /// The threads of the live view; they end with the server.
    _threads: Arc<[Worker; 2]>,
}

impl FromRef<Http> for App {
    fn from_ref(http: &Http) -> Self {
        http.app.clone()
    }
}

impl Http {
    /// Everything except the port.
    ///
    /// # Errors
    /// If a thread cannot be started.
    pub fn start(app: App, config: HttpConfig) -> Result<Self, Failure> {
        let no_thread = |cause: std::io::Error| {
            Failure::new(FailureKind::Internal, "a thread of the live view cannot be started").because(&cause)
        };
        let direction = app.config.projector.direction_of(0);
        let view = live::view::start(&app.station, app.live.clone(), direction).map_err(no_thread)?;
        let sources = Sources {
            live: app.live.clone(),
            frames: app.station.watch_frames(),
            status: app.station.watch_status(),
            control: app.control.watch(),
            jobs: app.jobs.watch_progress(),
            events: app.catalogue.watch_events(),
        };
        let (streams, encoder) = Streams::start(sources, direction, app.closing.clone()).map_err(no_thread)?;
        let (config, figures) = (Arc::new(config), figures()?);
        Ok(Self { app, config, streams, figures, _threads: Arc::new([view, encoder]) })
    }

    /// Serves `listener` until the service shuts down.
    pub fn serve(self, listener: TcpListener) -> JoinHandle<()> {
        let (closing, tasks, figures) = (self.app.closing.clone(), self.app.tasks.clone(), self.figures.clone());
        let upkeep = async move {
            let mut period = tokio::time::interval(limits::FIGURES_UPKEEP);
            loop {
                period.tick().await;
                figures.run_upkeep();
            }
        };
        let edge = edge::serve(listener, router::router(self), closing, tasks);
        tokio::spawn(async move {
            tokio::select! {
                () = edge => {}
                () = upkeep => {}
            }
        })
    }
}

fn figures() -> Result<PrometheusHandle, Failure> {
    /// Histogram buckets, seconds: from unnoticeable to annoying.
    const BUCKETS: [f64; 9] = [0.001, 0.005, 0.02, 0.05, 0.1, 0.5, 1.0, 5.0, 30.0];
    let builder = PrometheusBuilder::new().set_buckets(&BUCKETS);
    builder
        .and_then(PrometheusBuilder::install_recorder)
        .map_err(|cause| Failure::new(FailureKind::Internal, "metrics cannot be collected").because(&cause))
}
