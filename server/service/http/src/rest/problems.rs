//! Problems as responses.

use axum::response::{IntoResponse, Response};

use crate::problem::{Problem, ProblemKind};

/// No route has this path.
pub async fn no_such_path(uri: axum::http::Uri) -> Problem {
    Problem::new(ProblemKind::NotFound, format!("{} does not exist", uri.path())).remedy("see /docs for all paths")
}

/// The route exists but not for this method.
pub async fn no_such_method(method: axum::http::Method, uri: axum::http::Uri) -> Problem {
    Problem::new(ProblemKind::MethodNotAllowed, format!("{method} is not supported for {}", uri.path()))
        .remedy("the header Allow lists the supported methods")
}

/// A handler panicked: a defect, reported without internals.
pub fn panicked(panic: Box<dyn std::any::Any + Send + 'static>) -> Response {
    let text = panic.downcast_ref::<String>().cloned();
    let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap_or_default();
    tracing::error!(panic = text, "a handler panicked");
    Problem::new(ProblemKind::Internal, "an internal error occurred")
        .remedy("report it together with the server log")
        .into_response()
}
