//! The service as run by the program: use cases and the interfaces enabled by the configuration.

use std::time::Duration;

use app::App;
use http::Http;
use pipeline::Failure;
use tokio::net::TcpListener;

use crate::config::Config;

/// Longest time from the signal to the end of the process. If something hangs longer, the process is aborted, and the
/// laser leases of the drivers expire.
pub const SHUTDOWN_LIMIT: Duration = Duration::from_secs(10);

/// Assembles the service, except for the listening socket.
///
/// # Errors
/// If the data directory or a door cannot be used, or a thread cannot be started.
pub async fn assemble(config: Config) -> Result<Http, Failure> {
    let doors = config.doors.doors().map_err(|bad| {
        Failure::bad_input(format!("[[{}]] number {}: {}", bad.key, bad.number, bad.bad))
            .remedy("correct the configuration")
    })?;
    Http::start(App::start(config.app, doors).await?, config.http)
}

/// Serves until `ended`, then shuts down in a safe order: the station, with its laser, first.
pub async fn run(http: Http, listener: TcpListener, ended: impl Future<Output = ()>) {
    let app = http.app.clone();
    let edge = http.serve(listener);
    let watching = app.watch();
    ended.await;
    tracing::info!("shutting down: the laser is turned off first");
    app.shut_down().await;
    watching.iter().for_each(tokio::task::JoinHandle::abort);
    app.drain().await;
    if edge.await.is_err() {
        tracing::error!("the HTTP server ended with an error");
    }
    tracing::info!("ended");
}
