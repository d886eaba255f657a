//! Responses: created, accepted, done.

use app::error::AppError;
use axum::Json;
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use headers::HeaderMapExt as _;
use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use serde::Serialize;
use serde_json::{Value, json};

use crate::problem::PROBLEM_TYPE;
use crate::problem::{Problem, ProblemKind};
use crate::rest::etag::tag;

/// A response that can be stored and replayed: status, `Location`, JSON.
#[derive(Debug, Clone, PartialEq)]
pub struct Reply {
    /// 200, 201 or 202; the status of the problem if the action failed after it had started.
    pub status: u16,
    /// The `Location` header, if any.
    pub location: Option<String>,
    /// The version of the body (`ETag`), if any.
    pub version: Option<String>,
    /// The body.
    pub body: Value,
}

impl Reply {
    /// 201: created at `location`.
    pub fn created(location: String, body: &impl Serialize) -> Self {
        Self { status: 201, location: Some(location), version: None, body: to_value(body) }
    }

    /// 202: a job was accepted.
    pub fn accepted(location: String, body: &impl Serialize) -> Self {
        Self { status: 202, location: Some(location), version: None, body: to_value(body) }
    }

    /// 200: done.
    pub fn done(version: Option<String>, body: &impl Serialize) -> Self {
        Self { status: 200, location: None, version, body: to_value(body) }
    }

    /// The action failed after it had started.
    pub fn broken(problem: &Problem) -> Self {
        Self { status: problem.status, location: None, version: None, body: to_value(problem) }
    }

    /// The form stored with the idempotency key.
    pub fn to_json(&self) -> Value {
        json!({ "status": self.status, "location": self.location, "version": self.version, "body": self.body })
    }

    /// Restored from the stored form.
    pub fn from_json(kept: &Value) -> Option<Self> {
        Some(Self {
            status: u16::try_from(kept["status"].as_u64()?).ok()?,
            location: kept["location"].as_str().map(str::to_owned),
            version: kept["version"].as_str().map(str::to_owned),
            body: kept["body"].clone(),
        })
    }
}

fn to_value(body: &impl Serialize) -> Value {
    serde_json::to_value(body).expect("wire types are plain data with text keys")
}

impl IntoResponse for Reply {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status).unwrap_or(StatusCode::OK);
        let mut response = (status, Json(self.body)).into_response();
        let location = self.location.map(|location| (header::LOCATION, location));
        let problem = (self.status >= 400).then(|| (header::CONTENT_TYPE, PROBLEM_TYPE.to_owned()));
        for (name, text) in [location, problem].into_iter().flatten() {
            if let Ok(value) = HeaderValue::from_str(&text) {
                response.headers_mut().insert(name, value);
            }
        }
        if let Some(tag) = self.version.as_deref().and_then(tag) {
            response.headers_mut().typed_insert(tag);
        }
        response
    }
}

/// Bytes with a media type, offered as a download if they have a name.
pub fn bytes(media_type: &'static str, file_name: Option<&str>, body: impl Into<axum::body::Body>) -> Response {
    let mut response = ([(header::CONTENT_TYPE, media_type)], body.into()).into_response();
    if let Some(offer) = file_name.and_then(|name| HeaderValue::from_str(&attachment(name)).ok()) {
        response.headers_mut().insert(header::CONTENT_DISPOSITION, offer);
    }
    response
}

/// `Content-Disposition` for any file name (RFC 6266): UTF-8, with an ASCII fallback for old clients.
fn attachment(name: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || " ._-()".contains(letter);
    let plain: String = name.chars().map(|letter| if is_plain(letter) { letter } else { '_' }).collect();
    let whole = utf8_percent_encode(name, NON_ALPHANUMERIC);
    format!("attachment; filename=\"{plain}\"; filename*=UTF-8''{whole}")
}

/// Streams an artifact; `what` names it in error messages.
///
/// It is verified before the response starts: a started response cannot report that the rest is damaged.
pub async fn artifact(
    app: &app::App,
    id: &store::ArtifactId,
    what: &str,
    media_type: &'static str,
    file_name: Option<&str>,
) -> Result<Response, Problem> {
    let damaged = |error| AppError::from(error).of_stored(what);
    app.artifacts.check(id).await.map_err(damaged)?;
    let reader = app.artifacts.open(id).await.map_err(damaged)?;
    let stream = tokio_util::io::ReaderStream::with_capacity(reader.bytes, STREAM_CHUNK_BYTES);
    let mut response = bytes(media_type, file_name, axum::body::Body::from_stream(stream));
    response.headers_mut().insert(header::CONTENT_LENGTH, HeaderValue::from(reader.size_bytes));
    // An artifact's id is the hash of its content.
    if let Some(tag) = tag(id.as_str()) {
        response.headers_mut().typed_insert(tag);
    }
    Ok(response)
}

/// Chunk size: few system calls, little memory per download.
const STREAM_CHUNK_BYTES: usize = 64 * 1024;

/// The value of a required header.
pub fn header_text(headers: &axum::http::HeaderMap, name: &HeaderName) -> Result<Option<String>, Problem> {
    let Some(value) = headers.get(name) else { return Ok(None) };
    let text = value.to_str().map_err(|_| {
        Problem::new(ProblemKind::BadRequest, format!("the header {name} is not plain text")).at(name.as_str())
    })?;
    Ok(Some(text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_keeps_the_name_of_its_part() {
        assert_eq!(
            attachment("Zahnrad \"7\"/α.ply"),
            "attachment; filename=\"Zahnrad _7___.ply\"; \
             filename*=UTF-8''Zahnrad%20%227%22%2F%CE%B1%2Eply"
        );
        assert!(HeaderValue::from_str(&attachment("a\r\nSet-Cookie: b")).is_ok());
    }
}
