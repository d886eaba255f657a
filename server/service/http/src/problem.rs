//! What went wrong, for a client: RFC 9457, with cause and remedy. One table of types, titles and status codes.

use app::error::{AppError, ErrorKind};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use pipeline::Failure;
use serde::{Deserialize, Serialize};
use station::StationRefusal;
use store::{DamagedRow, StoreError};
use utoipa::ToSchema;

/// The types of problems; each is one row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ProblemKind {
    /// The request is not what the API understands.
    BadRequest,
    /// No such thing.
    NotFound,
    /// The path exists, the method does not.
    MethodNotAllowed,
    /// Nobody has, or somebody else has, the control lease.
    ControlRequired,
    /// The control lease that came along has run out.
    ControlExpired,
    /// The station was stopped and not reset since.
    Halted,
    /// The station does something else.
    StationBusy,
    /// The state of the thing does not allow it.
    Conflict,
    /// Somebody changed it meanwhile (`If-Match`).
    Changed,
    /// An edit without `If-Match`.
    PreconditionRequired,
    /// A body that did not arrive in time.
    TimedOut,
    /// Too many bytes.
    TooLarge,
    /// A range of bytes of which none is there.
    RangeNotSatisfiable,
    /// A body of another type.
    UnsupportedMediaType,
    /// Understood, but impossible.
    Impossible,
    /// The same `Idempotency-Key` with another body.
    KeyReused,
    /// Too many queued jobs or connections.
    TooMany,
    /// A Host or Origin that is not allowed.
    Forbidden,
    /// A defect of the program.
    Internal,
    /// A device does not answer, or the station is in error.
    DeviceFault,
    /// A file or record of the store is not what was written, or not there.
    Damaged,
    /// The server is starting or shutting down.
    Unavailable,
    /// The disk is full.
    StorageFull,
    /// Stopped by a person.
    Stopped,
}

impl ProblemKind {
    /// The row: type (the last part of its URN), title, status.
    pub fn row(self) -> (&'static str, &'static str, u16) {
        match self {
            Self::BadRequest => ("bad-request", "The request cannot be understood", 400),
            Self::NotFound => ("not-found", "There is no such thing", 404),
            Self::MethodNotAllowed => ("method-not-allowed", "This cannot be done here", 405),
            Self::ControlRequired => ("control-required", "The control lease is needed", 409),
            Self::ControlExpired => ("control-expired", "The control lease has expired", 409),
            Self::Halted => ("halted", "The station was stopped", 409),
            Self::StationBusy => ("station-busy", "The station is busy", 409),
            Self::Conflict => ("conflict", "The present state does not allow it", 409),
            Self::Changed => ("changed", "It was changed meanwhile", 412),
            Self::PreconditionRequired => ("precondition-required", "Say which version is meant", 428),
            Self::TimedOut => ("timed-out", "The request did not arrive in time", 408),
            Self::TooLarge => ("too-large", "Too many bytes", 413),
            Self::UnsupportedMediaType => ("unsupported-media-type", "The body is of another type", 415),
            Self::RangeNotSatisfiable => ("range-not-satisfiable", "Nothing lies in that range", 416),
            Self::Impossible => ("impossible", "Understood, but impossible", 422),
            Self::KeyReused => ("key-reused", "The idempotency key belongs to another request", 422),
            Self::TooMany => ("too-many", "Too many at once", 429),
            Self::Forbidden => ("forbidden", "Not allowed", 403),
            Self::Internal => ("internal", "A defect of the program", 500),
            Self::DeviceFault => ("device-fault", "A device does not do what it should", 503),
            Self::Damaged => ("damaged", "What is stored is damaged or missing", 503),
            Self::Unavailable => ("unavailable", "Not now", 503),
            Self::StorageFull => ("storage-full", "The disk is full", 507),
            Self::Stopped => ("stopped", "Stopped by a person", 409),
        }
    }
}

/// The body `application/problem+json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Problem {
    /// `urn:sheaf:problem:…`, stable.
    pub r#type: String,
    /// Short and the same for every problem of this type.
    pub title: String,
    /// The HTTP status.
    pub status: u16,
    /// What happened here.
    pub detail: String,
    /// Why, as far as known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
    /// What to do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remedy: Option<String>,
    /// Where in the input: a JSON pointer, a file, an entry.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pointer: Option<String>,
    /// When to try again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retry_after_s: Option<u64>,
}

impl Problem {
    /// A problem of that kind.
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

    /// With what to do about it.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
        self
    }

    /// With the reason behind it.
    pub fn because(mut self, cause: impl Into<String>) -> Self {
        self.cause = Some(cause.into());
        self
    }

    /// With the place in the input.
    pub fn at(mut self, pointer: impl Into<String>) -> Self {
        self.pointer = Some(pointer.into());
        self
    }

    /// With the time after which it may work.
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

/// The runtime ended a request before its end.
pub fn cut_off(cause: &tokio::task::JoinError) -> Response {
    Problem::new(ProblemKind::Unavailable, "the service ended before the request did")
        .because(cause.to_string())
        .into_response()
}
