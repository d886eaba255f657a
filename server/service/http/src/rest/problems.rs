//! Problems as answers.

use axum::response::{IntoResponse, Response};

use crate::problem::{Problem, ProblemKind};

/// No route has this path.
pub async fn no_such_path(uri: axum::http::Uri) -> Problem {
    Problem::new(ProblemKind::NotFound, format!("there is no {}", uri.path()))
        .remedy("see /docs for what there is")
}

/// A route has this path, not this method.
pub async fn no_such_method(method: axum::http::Method, uri: axum::http::Uri) -> Problem {
    Problem::new(ProblemKind::MethodNotAllowed, format!("{method} makes no sense for {}", uri.path()))
        .remedy("the header Allow names the methods that do")
}

/// A handler panicked: a defect, reported without internals.
pub fn panicked(panic: Box<dyn std::any::Any + Send + 'static>) -> Response {
    let text = panic.downcast_ref::<String>().cloned();
    let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap_or_default();
    tracing::error!(panic = text, "a handler panicked");
    Problem::new(ProblemKind::Internal, "the request met a defect of the program")
        .remedy("report it with the log of the server")
        .into_response()
}
