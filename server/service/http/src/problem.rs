//! Problem details for clients (RFC 9457), with cause and remedy. One table of types, titles and status codes.

use app::error::{AppError, ErrorKind};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use pipeline::Failure;
use serde::{Deserialize, Serialize};
use station::StationRefusal;
use store::{DamagedRow, StoreError};
use utoipa::ToSchema;

/// The problem types; each is one row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ProblemKind {
    /// The request is malformed.
    BadRequest,
    /// The resource does not exist.
    NotFound,
    /// The path exists but does not support the method.
    MethodNotAllowed,
    /// The caller does not hold the control lease.
    ControlRequired,
    /// The control lease sent with the request has expired.
    ControlExpired,
    /// The station was stopped and has not been reset since.
    Halted,
    /// The station is busy with something else.
    StationBusy,
    /// The state of the resource does not allow it.
    Conflict,
    /// The resource was changed in the meantime (`If-Match`).
    Changed,
    /// A change without `If-Match`.
    PreconditionRequired,
    /// The body did not arrive in time.
    TimedOut,
    /// The body is too large.
    TooLarge,
    /// The requested byte range lies outside the file.
    RangeNotSatisfiable,
    /// The body has an unsupported media type.
    UnsupportedMediaType,
    /// The request is well-formed but cannot be carried out.
    Impossible,
    /// The same `Idempotency-Key` with another body.
    KeyReused,
    /// Too many queued jobs or connections.
    TooMany,
    /// The Host or Origin is not allowed.
    Forbidden,
    /// An internal error.
    Internal,
    /// A device does not answer, or the station is in error.
    DeviceFault,
    /// A stored file or record is damaged or missing.
    Damaged,
    /// The server is starting or shutting down.
    Unavailable,
    /// The disk is full.
    StorageFull,
    /// Stopped by a user.
    Stopped,
}

impl ProblemKind {
    /// The row: type (the last part of its URN), title, status.
    pub fn row(self) -> (&'static str, &'static str, u16) {
        match self {
            Self::BadRequest => ("bad-request", "Malformed request", 400),
            Self::NotFound => ("not-found", "Not found", 404),
            Self::MethodNotAllowed => ("method-not-allowed", "Method not allowed", 405),
            Self::ControlRequired => ("control-required", "Control required", 409),
            Self::ControlExpired => ("control-expired", "Control expired", 409),
            Self::Halted => ("halted", "Station stopped: reset it first", 409),
            Self::StationBusy => ("station-busy", "Station busy", 409),
            Self::Conflict => ("conflict", "Not possible in the current state", 409),
            Self::Changed => ("changed", "Changed in the meantime", 412),
            Self::PreconditionRequired => ("precondition-required", "If-Match header missing", 428),
            Self::TimedOut => ("timed-out", "Request timed out", 408),
            Self::TooLarge => ("too-large", "Request too large", 413),
            Self::UnsupportedMediaType => ("unsupported-media-type", "Unsupported media type", 415),
            Self::RangeNotSatisfiable => ("range-not-satisfiable", "Range not satisfiable", 416),
            Self::Impossible => ("impossible", "Request cannot be carried out", 422),
            Self::KeyReused => ("key-reused", "Idempotency key already used for another request", 422),
            Self::TooMany => ("too-many", "Too many requests", 429),
            Self::Forbidden => ("forbidden", "Not allowed", 403),
            Self::Internal => ("internal", "Internal error", 500),
            Self::DeviceFault => ("device-fault", "Device fault", 503),
            Self::Damaged => ("damaged", "Stored data damaged or missing", 503),
            Self::Unavailable => ("unavailable", "Service unavailable", 503),
            Self::StorageFull => ("storage-full", "Disk full", 507),
            Self::Stopped => ("stopped", "Stopped by a user", 409),
        }
    }
}

/// The body `application/problem+json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Problem {
    /// `urn:sheaf:problem:…`, stable.
    pub r#type: String,
    /// Short summary, the same for every problem of this type.
    pub title: String,
    /// The HTTP status.
    pub status: u16,
    /// What went wrong in this case.
    pub detail: String,
    /// The cause, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
    /// What to do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remedy: Option<String>,
    /// Where in the input: a JSON pointer, a file or an entry.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pointer: Option<String>,
    /// Seconds after which to retry.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retry_after_s: Option<u64>,
}

impl Problem {
    /// A problem of this kind.
    pub fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        let (slug, title, status) = kind.row();
        Self {
            r#type: format!("urn:sheaf:problem:{slug}"),
            title: title.to_owned(),
            status,
            detail: detail.into(),
            cause: None,
            remedy: None,
            pointer: None,
            retry_after_s: None,
        }
    }

    /// Adds the remedy.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
        self
    }

    /// Adds the cause.
    pub fn because(mut self, cause: impl Into<String>) -> Self {
        self.cause = Some(cause.into());
        self
    }

    /// Adds the place in the input.
    pub fn at(mut self, pointer: impl Into<String>) -> Self {
        self.pointer = Some(pointer.into());
        self
    }

    /// Adds the time after which to retry.
    pub fn retry_after_s(mut self, seconds: u64) -> Self {
        self.retry_after_s = Some(seconds);
        self
    }
}

impl From<ErrorKind> for ProblemKind {
    fn from(kind: ErrorKind) -> Self {
        match kind {
            ErrorKind::BadRequest => Self::BadRequest,
            ErrorKind::NotFound => Self::NotFound,
            ErrorKind::ControlRequired => Self::ControlRequired,
            ErrorKind::ControlExpired => Self::ControlExpired,
            ErrorKind::Halted => Self::Halted,
            ErrorKind::StationBusy => Self::StationBusy,
            ErrorKind::Conflict => Self::Conflict,
            ErrorKind::Changed => Self::Changed,
            ErrorKind::TooLarge => Self::TooLarge,
            ErrorKind::Impossible => Self::Impossible,
            ErrorKind::TooMany => Self::TooMany,
            ErrorKind::Internal => Self::Internal,
            ErrorKind::DeviceFault => Self::DeviceFault,
            ErrorKind::Damaged => Self::Damaged,
            ErrorKind::Unavailable => Self::Unavailable,
            ErrorKind::StorageFull => Self::StorageFull,
            ErrorKind::Stopped => Self::Stopped,
        }
    }
}

impl From<AppError> for Problem {
    fn from(error: AppError) -> Self {
        let AppError { kind, detail, cause, remedy, pointer, retry_after_s } = error;
        Self { cause, remedy, pointer, retry_after_s, ..Self::new(kind.into(), detail) }
    }
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        AppError::from(error).into()
    }
}

impl From<DamagedRow> for Problem {
    fn from(row: DamagedRow) -> Self {
        StoreError::from(row).into()
    }
}

impl From<StationRefusal> for Problem {
    fn from(refusal: StationRefusal) -> Self {
        AppError::from(refusal).into()
    }
}

impl From<Failure> for Problem {
    fn from(failure: Failure) -> Self {
        AppError::from(failure).into()
    }
}

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
                "request answered with a problem"
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

/// The runtime shut down before the request finished.
pub fn cut_off(cause: &tokio::task::JoinError) -> Response {
    Problem::new(ProblemKind::Unavailable, "the service shut down before the request finished")
        .because(cause.to_string())
        .into_response()
}
