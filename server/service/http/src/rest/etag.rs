//! Versions of shared resources: `ETag` in responses, `If-Match` in changes.

use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, Response};

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::header_text;

/// A response with its version.
pub struct Versioned<T>(pub String, pub T);

impl<T: IntoResponse> IntoResponse for Versioned<T> {
    fn into_response(self) -> Response {
        let mut response = self.1.into_response();
        if let Ok(value) = HeaderValue::from_str(&quoted(&self.0)) {
            response.headers_mut().insert(header::ETAG, value);
        }
        response
    }
}

/// A version as the header has it.
pub fn quoted(version: &str) -> String {
    format!("\"{version}\"")
}

/// Passes if `If-Match` names the version `current` (or `*`), or is missing.
pub fn check_if_given(headers: &HeaderMap, current: &str) -> Result<(), Problem> {
    let Some(wanted) = header_text(headers, &header::IF_MATCH)? else { return Ok(()) };
    let mut versions = wanted.split(',').map(str::trim);
    if versions.any(|version| version == "*" || version == quoted(current)) {
        return Ok(());
    }
    Err(Problem::new(ProblemKind::Changed, format!("the version is {}, not {wanted}", quoted(current)))
        .remedy("read it again, then repeat the change"))
}

/// Passes only if `If-Match` names the version `current` (or `*`).
pub fn check(headers: &HeaderMap, current: &str) -> Result<(), Problem> {
    if !headers.contains_key(header::IF_MATCH) {
        return Err(Problem::new(ProblemKind::PreconditionRequired, "a change needs the header If-Match")
            .remedy("read the resource and send its ETag as If-Match"));
    }
    check_if_given(headers, current)
}
