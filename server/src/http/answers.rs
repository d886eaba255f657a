//! Answers in the API's manner: made, accepted, done.

use axum::Json;
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::{Value, json};

use crate::problem::{Problem, ProblemKind};

/// An answer that can be kept and given again: status, `Location`, JSON.
#[derive(Debug, Clone, PartialEq)]
pub struct Reply {
    /// 201 or 202.
    pub status: u16,
    /// Where the thing is.
    pub location: String,
    /// The body.
    pub body: Value,
}

impl Reply {
    /// Something was made at `location`.
    pub fn created(location: String, body: &impl Serialize) -> Self {
        Self { status: 201, location, body: to_value(body) }
    }

    /// A job was accepted.
    pub fn accepted(location: String, body: &impl Serialize) -> Self {
        Self { status: 202, location, body: to_value(body) }
    }

    /// As kept with the key of the request.
    pub fn to_json(&self) -> Value {
        json!({ "status": self.status, "location": self.location, "body": self.body })
    }

    /// As kept before.
    pub fn from_json(kept: &Value) -> Option<Self> {
        Some(Self {
            status: u16::try_from(kept["status"].as_u64()?).ok()?,
            location: kept["location"].as_str()?.to_owned(),
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
        if let Ok(location) = HeaderValue::from_str(&self.location) {
            response.headers_mut().insert(header::LOCATION, location);
        }
        response
    }
}

/// Bytes of a stated type, offered as a file if they have a name.
pub fn bytes(media_type: &'static str, file_name: Option<&str>, body: impl Into<axum::body::Body>) -> Response {
    let mut response = ([(header::CONTENT_TYPE, media_type)], body.into()).into_response();
    if let Some(name) =
        file_name.and_then(|name| HeaderValue::from_str(&format!("attachment; filename=\"{name}\"")).ok())
    {
        response.headers_mut().insert(header::CONTENT_DISPOSITION, name);
    }
    response
}

/// The bytes of an artifact, streamed.
pub async fn artifact(
    app: &crate::app::App,
    id: &store::ArtifactId,
    media_type: &'static str,
    file_name: Option<&str>,
) -> Result<Response, Problem> {
    let reader = app.artifacts.open(id).await?;
    let stream = tokio_util::io::ReaderStream::with_capacity(reader.bytes, STREAM_CHUNK_BYTES);
    let mut response = bytes(media_type, file_name, axum::body::Body::from_stream(stream));
    response.headers_mut().insert(header::CONTENT_LENGTH, HeaderValue::from(reader.size_bytes));
    // An artifact is named by its content.
    if let Ok(tag) = HeaderValue::from_str(&format!("\"{}\"", id.as_str())) {
        response.headers_mut().insert(header::ETAG, tag);
    }
    Ok(response)
}

/// Read and sent at once: few system calls, little memory per download.
const STREAM_CHUNK_BYTES: usize = 64 * 1024;

/// A value of a header that a handler needs.
pub fn header_text(headers: &axum::http::HeaderMap, name: &HeaderName) -> Result<Option<String>, Problem> {
    let Some(value) = headers.get(name) else { return Ok(None) };
    let text = value.to_str().map_err(|_| {
        Problem::new(ProblemKind::BadRequest, format!("the header {name} is not plain text")).at(name.as_str())
    })?;
    Ok(Some(text.to_owned()))
}
