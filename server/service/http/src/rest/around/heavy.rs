//! Requests that need a core and much memory for seconds run one at a time, so that many of them neither starve the
//! station nor exhaust memory while the laser is on.

use std::sync::Arc;

use axum::extract::{MatchedPath, Request, State};
use axum::http::Method;
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};
use tokio::sync::Semaphore;

use crate::limits::{HEAVY_REQUESTS, HEAVY_WAIT};
use crate::problem::{Problem, ProblemKind};

/// The matched routes.
const HEAVY: [(Method, &str); 5] = [
    (Method::GET, "/api/v1/scans/{id}/cloud"),
    (Method::GET, "/api/v1/scans/{id}/mesh"),
    (Method::GET, "/api/v1/scans/{id}/exports/{file}"),
    (Method::POST, "/api/v1/scans/{id}/measurements"),
    (Method::GET, "/api/v1/calibrations/{id}/diff"),
];

/// The permits of such requests.
#[derive(Debug, Clone)]
pub struct Places(Arc<Semaphore>);

impl Default for Places {
    fn default() -> Self {
        Self(Arc::new(Semaphore::new(HEAVY_REQUESTS)))
    }
}

/// Lets a heavy request wait a moment for a permit; after that the client is asked to retry.
pub async fn limit(State(places): State<Places>, request: Request, next: Next) -> Response {
    let path = request.extensions().get::<MatchedPath>().map(|path| path.as_str().to_owned()).unwrap_or_default();
    if !HEAVY.iter().any(|(method, heavy)| request.method() == method && path == *heavy) {
        return next.run(request).await;
    }
    match tokio::time::timeout(HEAVY_WAIT, places.0.acquire()).await {
        Ok(Ok(_place)) => next.run(request).await,
        _ => Problem::new(ProblemKind::TooMany, "another large computation is running")
            .remedy("request them one after the other")
            .retry_after_s(HEAVY_WAIT.as_secs())
            .into_response(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_heavy_route_is_part_of_the_api() {
        let document = serde_json::to_value(crate::rest::openapi::routes_and_document().1).unwrap();
        for (method, path) in HEAVY {
            let operation = &document["paths"][path][method.as_str().to_lowercase()];
            assert!(operation.is_object(), "{method} {path} is not a route");
        }
    }
}
