//! Problems as answers.

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

use crate::problem::{Problem, ProblemKind};

/// `application/problem+json`.
pub const PROBLEM_TYPE: &str = "application/problem+json";

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        if status.is_server_error() {
            tracing::warn!(
                kind = self.r#type,
                detail = self.detail,
                cause = self.cause,
                "answered with a problem"
            );
        }
        let body = serde_json::to_vec(&self).expect("a problem is texts and numbers");
        let mut response = (status, [(header::CONTENT_TYPE, PROBLEM_TYPE)], body).into_response();
        if let Some(seconds) = self.retry_after_s {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds));
        }
        response
    }
}

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

/// The runtime ended a request before its end.
pub fn cut_off(cause: &tokio::task::JoinError) -> Response {
    Problem::new(ProblemKind::Unavailable, "the service ended before the request did")
        .because(cause.to_string())
        .into_response()
}

/// A handler panicked: a defect, told without its inside.
pub fn panicked(panic: Box<dyn std::any::Any + Send + 'static>) -> Response {
    let text = panic.downcast_ref::<String>().cloned();
    let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap_or_default();
    tracing::error!(panic = text, "a handler panicked");
    Problem::new(ProblemKind::Internal, "the request met a defect of the program")
        .remedy("report it with the log of the server")
        .into_response()
}
