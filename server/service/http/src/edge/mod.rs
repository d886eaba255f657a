//! The accept loop: slow, silent or too many clients must not affect the others.
//!
//! Every client must send each request header within ten seconds and read bytes at least every twelve; there are
//! at most [`CONNECTION_LIMIT`] of them. Beyond that a few are accepted for Stop alone. Why not the framework's
//! built-in server: ADR 0010.

mod stalled;
mod stop_slots;

use std::convert::Infallible;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::Request;
use axum::http::Method;
use axum::response::{IntoResponse as _, Response};
use futures_util::FutureExt as _;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::task::{JoinHandle, JoinSet};
use tokio_util::task::TaskTracker;
use tower::ServiceExt as _;

use crate::limits::{
    CONNECTION_LIMIT, HEADER_TIMEOUT, STOP_CONNECTION_LIMIT, STOP_HEADER_TIMEOUT, WRITE_STALL_TIMEOUT,
};
use crate::problem::{Problem, ProblemKind};
use app::limits::DRAIN_TIMEOUT;
use stalled::NeverStalled;
use stop_slots::StopSlots;
use tokio_util::sync::CancellationToken;

/// The only path that a connection beyond the limit may call.
pub const STOP_PATH: &str = "/api/v1/station/stop";

/// Ends of the paths of computations that change nothing, although their input makes them a `POST`.
const COMPUTATIONS: [&str; 2] = ["/evaluate", "/find-features"];

/// Maximum size of a request header, bytes.
const HEADER_LIMIT_BYTES: usize = 64 * 1024;

/// Pause after a failed accept (no file handles left), so that the loop does not spin.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// The client's address, stored in the extensions of every request.
#[derive(Debug, Clone, Copy)]
pub struct Peer(pub SocketAddr);

/// The local address that the client connected to, stored in the extensions of every request.
#[derive(Debug, Clone, Copy)]
pub struct Reached(pub std::net::IpAddr);

/// Where a request came from, for the event log.
pub fn source(peer: Option<&Peer>) -> String {
    peer.map_or_else(|| "server".to_owned(), |peer| peer.0.ip().to_string())
}

/// What a connection may request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Admission {
    /// Everything.
    Full,
    /// Stop only: there are too many connections.
    StopOnly,
}

/// Accepts connections until `closing`, then waits up to [`DRAIN_TIMEOUT`] for open requests to finish.
///
/// A request that changes something runs to completion on `tasks` once its header has been read, even if the client
/// disconnects: a half-finished change is worse than an unread answer, and a Stop must not depend on its client.
pub async fn serve(listener: TcpListener, router: Router, closing: CancellationToken, tasks: TaskTracker) {
    let places = Arc::new(Semaphore::new(CONNECTION_LIMIT));
    let stop_slots = StopSlots::new(STOP_CONNECTION_LIMIT);
    let mut connections = JoinSet::new();
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            () = closing.cancelled() => break,
            Some(_) = connections.join_next() => continue,
        };
        let (stream, peer) = match accepted {
            Ok(accepted) => accepted,
            Err(cause) => {
                tracing::warn!(%cause, "cannot accept a connection");
                tokio::time::sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        match places.clone().try_acquire_owned() {
            Ok(place) => {
                let connection = serve_connection(
                    stream,
                    peer,
                    router.clone(),
                    Admission::Full,
                    closing.clone(),
                    tasks.clone(),
                );
                connections.spawn(async move {
                    connection.await;
                    drop(place);
                });
            }
            Err(_) => {
                metrics::counter!("sheaf_connections_refused_total").increment(1);
                let connection = serve_connection(
                    stream,
                    peer,
                    router.clone(),
                    Admission::StopOnly,
                    closing.clone(),
                    tasks.clone(),
                );
                let slot = stop_slots.take(peer.ip());
                connections.spawn(async move { slot.hold(connection).await });
            }
        }
    }
    drop(listener);
    let drained = async { while connections.join_next().await.is_some() {} };
    if tokio::time::timeout(DRAIN_TIMEOUT, drained).await.is_err() {
        tracing::info!("connections were still open at shutdown");
    }
}

async fn serve_connection(
    stream: TcpStream,
    peer: SocketAddr,
    router: Router,
    admission: Admission,
    closing: CancellationToken,
    tasks: TaskTracker,
) {
    // Small live-stream messages must not be delayed by Nagle's algorithm; if this fails the socket is only slower.
    let _ = stream.set_nodelay(true);
    let reached = stream.local_addr().ok().map(|address| Reached(address.ip()));
    let service = hyper::service::service_fn(move |mut request: Request<Incoming>| {
        if let Some(reached) = reached {
            request.extensions_mut().insert(reached);
        }
        let lasting = outlives_client(request.method(), request.uri().path());
        let answering = answer(request.map(Body::new), peer, router.clone(), admission);
        // Spawned here rather than on first poll: the answer of a client that has gone is never polled.
        if lasting { detached(tasks.spawn(answering)).boxed() } else { answering.boxed() }
    });
    let (keep_alive, header_timeout) = match admission {
        Admission::Full => (true, HEADER_TIMEOUT),
        Admission::StopOnly => (false, STOP_HEADER_TIMEOUT),
    };
    let io = TokioIo::new(NeverStalled::new(stream, WRITE_STALL_TIMEOUT));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(header_timeout)
        .keep_alive(keep_alive)
        .max_buf_size(HEADER_LIMIT_BYTES)
        .serve_connection(io, service)
        .with_upgrades();
    let mut connection = std::pin::pin!(connection);
    let ended = tokio::select! {
        ended = connection.as_mut() => ended,
        () = closing.cancelled() => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
    if let Err(cause) = ended {
        tracing::debug!(%peer, %cause, "connection ended");
    }
}

/// Whether a request is completed even if its client goes away: if it changes something.
fn outlives_client(method: &Method, path: &str) -> bool {
    let computes = method == Method::POST && COMPUTATIONS.iter().any(|computation| path.ends_with(computation));
    !method.is_safe() && !computes
}

/// The answer of a request that runs in its own task.
async fn detached(task: JoinHandle<Result<Response, Infallible>>) -> Result<Response, Infallible> {
    match task.await {
        Ok(answered) => answered,
        // A panic is answered inside the task; only a runtime shutdown gets here.
        Err(ended) => Ok(crate::problem::cut_off(&ended)),
    }
}

async fn answer(
    mut request: Request,
    peer: SocketAddr,
    router: Router,
    admission: Admission,
) -> Result<Response, Infallible> {
    request.extensions_mut().insert(Peer(peer));
    if admission == Admission::StopOnly && request.uri().path() != STOP_PATH {
        return Ok(too_many().into_response());
    }
    router.oneshot(request).await
}

fn too_many() -> Problem {
    Problem::new(ProblemKind::Unavailable, format!("the limit of {CONNECTION_LIMIT} open connections is reached"))
        .remedy("close some, or try again; Stop still works")
        .retry_after_s(5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_something_outlives_its_client_and_a_mere_computation_does_not() {
        let check = |method: Method, path: &str, expected: bool| {
            assert_eq!(outlives_client(&method, path), expected, "{method} {path}");
        };
        check(Method::GET, "/api/v1/scans", false);
        check(Method::POST, STOP_PATH, true);
        check(Method::POST, "/api/v1/scans/7/measurements", true);
        check(Method::DELETE, "/api/v1/scans/evaluate", true);
        check(Method::POST, "/api/v1/inspections/7/re-evaluate", true);
        check(Method::POST, "/api/v1/scans/7/evaluate", false);
        check(Method::POST, "/api/v1/scans/7/find-features", false);
    }

    #[test]
    fn every_computation_is_part_of_the_api() {
        let document = crate::rest::openapi::checked_in_document();
        for end in COMPUTATIONS {
            assert!(
                document["paths"][format!("/api/v1/scans/{{id}}{end}")]["post"].is_object(),
                "{end} is not a route"
            );
        }
    }
}
