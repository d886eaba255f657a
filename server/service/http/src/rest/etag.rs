//! Versions of shared resources: `ETag` in responses, `If-Match` in changes.

use axum::http::HeaderMap;
use axum::response::{IntoResponse, Response};
use headers::{ETag, HeaderMapExt as _, IfMatch};

use crate::problem::{Problem, ProblemKind};

/// A response with its version.
pub struct Versioned<T>(pub String, pub T);

impl<T: IntoResponse> IntoResponse for Versioned<T> {
    fn into_response(self) -> Response {
        let mut response = self.1.into_response();
        if let Some(tag) = tag(&self.0) {
            response.headers_mut().typed_insert(tag);
        }
        response
    }
}

/// A version as its header has it; `None` if a header cannot hold it.
pub fn tag(version: &str) -> Option<ETag> {
    format!("\"{version}\"").parse().ok()
}

/// Passes if `If-Match` names the version `current` (or `*`), or is missing.
pub fn check_if_given(headers: &HeaderMap, current: &str) -> Result<(), Problem> {
    let Some(wanted) = if_match(headers)? else { return Ok(()) };
    if tag(current).is_some_and(|tag| wanted.precondition_passes(&tag)) {
        return Ok(());
    }
    Err(Problem::new(ProblemKind::Changed, format!("the version is \"{current}\", which If-Match does not name"))
        .remedy("read it again, then repeat the change"))
}

/// Passes only if `If-Match` names the version `current` (or `*`).
pub fn check(headers: &HeaderMap, current: &str) -> Result<(), Problem> {
    if if_match(headers)?.is_none() {
        return Err(Problem::new(ProblemKind::PreconditionRequired, "a change needs the header If-Match")
            .remedy("read the resource and send its ETag as If-Match"));
    }
    check_if_given(headers, current)
}

fn if_match(headers: &HeaderMap) -> Result<Option<IfMatch>, Problem> {
    headers.typed_try_get().map_err(|_| {
        let detail = "it is neither `*` nor a list of versions in double quotes";
        Problem::new(ProblemKind::BadRequest, detail)
            .at("If-Match")
            .remedy("send the ETag of a response unchanged")
    })
}
