//! `sheaf serve`: runs the service until SIGTERM or SIGINT.

use std::io::Write as _;
use std::net::SocketAddr;

use serde_json::json;
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tracing_subscriber::EnvFilter;

use crate::arguments::ServeArgs;
use crate::commands::Answer;
use crate::commands::service::config::effective_of;
use crate::service;
use pipeline::{Failure, FailureKind};

/// Serves until SIGTERM or SIGINT.
pub fn run(args: &ServeArgs, json: bool) -> Result<Answer, Failure> {
    crate::heap::memory::return_large_blocks();
    let effective = effective_of(&args.settings)?;
    log_to_stderr(json);
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .thread_name("serve")
        .build()
        .map_err(|cause| Failure::new(FailureKind::Internal, "no threads can be started").because(&cause))?;
    let outcome = runtime.block_on(serve(effective.config));
    // Threads that still block are abandoned; the laser leases of the drivers expire.
    runtime.shutdown_timeout(service::SHUTDOWN_LIMIT / 5);
    outcome.map(|()| Answer::done(String::new(), json!({ "ended": true })))
}

async fn serve(config: crate::config::Config) -> Result<(), Failure> {
    let mut terminate = on(SignalKind::terminate())?;
    let mut interrupt = on(SignalKind::interrupt())?;
    let (listen, trusted_proxy) = (config.listen, config.http.trusted_proxy);
    if !listen.ip().is_loopback() && !trusted_proxy {
        return Err(Failure::new(
            FailureKind::BadParameter,
            format!(
                "{listen} is reachable from other machines, but the service has no user management and no TLS"
            ),
        )
        .remedy("listen on 127.0.0.1, or use a reverse proxy that handles both and set http.trusted_proxy=true"));
    }
    // The port is bound first, before anything slow; requests are answered once the service is complete.
    let listener = TcpListener::bind(listen).await.map_err(|cause| cannot_listen(listen, &cause))?;
    let address = listener.local_addr().map_err(|cause| cannot_listen(listen, &cause))?;
    let http = service::assemble(config).await?;
    announce(address);
    log_notices(&http, trusted_proxy);
    let ended = async move {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
    };
    service::run(http, listener, ended).await;
    Ok(())
}

fn on(kind: SignalKind) -> Result<tokio::signal::unix::Signal, Failure> {
    signal(kind).map_err(|cause| Failure::new(FailureKind::Internal, "signals cannot be received").because(&cause))
}

fn cannot_listen(address: SocketAddr, cause: &std::io::Error) -> Failure {
    Failure::new(FailureKind::BadParameter, format!("cannot listen on {address}"))
        .because(cause)
        .remedy("choose another --listen address, or stop the program that uses it")
}

/// Logs notices at start-up.
fn log_notices(http: &http::Http, trusted_proxy: bool) {
    if trusted_proxy {
        tracing::warn!(
            "http.trusted_proxy is set: the reverse proxy in front of this server handles users and TLS"
        );
    }
    if let Some(lost_host) = http.app.station.status().laser_lost_host {
        tracing::info!("if this program is killed, {lost_host}");
    }
}

/// Prints the URL, the only line on stdout.
fn announce(address: SocketAddr) {
    let mut out = std::io::stdout().lock();
    // A closed stdout is no reason not to serve.
    let _ = writeln!(out, "http://{address}/").and_then(|()| out.flush());
}

fn log_to_stderr(json: bool) {
    let filter = EnvFilter::try_from_env("SHEAF_LOG").unwrap_or_else(|_| EnvFilter::new("info"));
    let lines = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    // Fails if a subscriber is already set, as in tests.
    let _ = if json { lines.json().try_init() } else { lines.with_ansi(false).try_init() };
}
