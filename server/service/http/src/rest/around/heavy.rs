//! Requests that need a core and much memory for seconds run one at a time, so that many of them neither starve the
//! station nor exhaust memory while the laser is on.

use std::sync::Arc;

use axum::extract::{MatchedPath, Request, State};
use axum::http::Method;
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::limits::{HEAVY_REQUESTS, HEAVY_WAIT};
use crate::problem::{Problem, ProblemKind};

/// The matched routes.
const HEAVY: [(Method, &str); 10] = [
    (Method::GET, "/api/v1/scans/{id}/cloud"),
    (Method::GET, "/api/v1/scans/{id}/mesh"),
    (Method::GET, "/api/v1/scans/{id}/exports/{file}"),
    (Method::POST, "/api/v1/scans/{id}/measurements"),
    (Method::POST, "/api/v1/scans/{id}/evaluate"),
    (Method::POST, "/api/v1/scans/{id}/deviations"),
    (Method::POST, "/api/v1/scans/{id}/find-features"),
    (Method::GET, "/api/v1/calibrations/{id}/diff"),
    (Method::GET, "/api/v1/recipes/{id}/versions/{version}/file"),
    (Method::POST, "/api/v1/recipes/import"),
];

/// Whether requests to this route run one at a time.
pub fn is_heavy(method: &Method, path: &str) -> bool {
    HEAVY.iter().any(|(heavy, of)| method == heavy && path == *of)
}

/// The permits of such requests.
#[derive(Debug, Clone)]
pub struct Places(Arc<Semaphore>);

/// The permit of a request. A handler passes it to a computation that continues when the client goes away.
#[derive(Debug, Clone)]
pub struct Place(#[allow(dead_code, reason = "it is only held")] Arc<OwnedSemaphorePermit>);

impl Default for Places {
    fn default() -> Self {
        Self(Arc::new(Semaphore::new(HEAVY_REQUESTS)))
    }
}

/// Lets a heavy request wait a moment for a permit; after that the client is asked to retry.
pub async fn limit(State(places): State<Places>, mut request: Request, next: Next) -> Response {
    let path = request.extensions().get::<MatchedPath>().map(|path| path.as_str().to_owned()).unwrap_or_default();
    if !is_heavy(request.method(), &path) {
        return next.run(request).await;
    }
    match tokio::time::timeout(HEAVY_WAIT, places.0.acquire_owned()).await {
        Ok(Ok(permit)) => {
            let place = Place(Arc::new(permit));
            request.extensions_mut().insert(place.clone());
            let response = next.run(request).await;
            drop(place);
            response
        }
        _ => Problem::new(ProblemKind::TooMany, "another large computation is running")
            .remedy("request them one after the other")
            .retry_after_s(HEAVY_WAIT.as_secs())
            .into_response(),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::time::Duration;

    use axum::body::Body;
    use axum::middleware::from_fn_with_state;
    use axum::routing::post;
    use axum::{Extension, Router};
    use tokio::sync::mpsc;
    use tower::ServiceExt as _;

    use super::*;

    /// A client that goes away frees the permit only when the computation that its handler began has ended.
    #[tokio::test]
    async fn a_computation_that_continues_keeps_its_permit() {
        let places = Places::default();
        let (begun, mut computations) = mpsc::channel::<Place>(1);
        let handler = move |Extension(place): Extension<Place>| async move {
            begun.send(place).await.unwrap();
            std::future::pending::<()>().await;
        };
        let router = Router::new()
            .route("/api/v1/scans/{id}/evaluate", post(handler))
            .layer(from_fn_with_state(places.clone(), limit));
        let request = Request::post("/api/v1/scans/7/evaluate").body(Body::empty()).unwrap();
        let client = tokio::spawn(router.oneshot(request));
        let computation = computations.recv().await.unwrap();
        client.abort();
        assert!(client.await.unwrap_err().is_cancelled());
        assert_eq!(places.0.available_permits(), HEAVY_REQUESTS - 1);
        drop(computation);
        let free = tokio::time::timeout(Duration::from_secs(30), places.0.acquire()).await;
        assert!(free.is_ok_and(|permit| permit.is_ok()));
    }

    #[test]
    fn every_heavy_route_is_part_of_the_api() {
        let document = crate::rest::openapi::checked_in_document();
        for (method, path) in HEAVY {
            let operation = &document["paths"][path][method.as_str().to_lowercase()];
            assert!(operation.is_object(), "{method} {path} is not a route");
        }
    }
}
