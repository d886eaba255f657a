//! Bodies, queries and paths as typed values; what cannot be parsed is a problem that names the place.

use std::time::Duration;

use axum::body::Body;
use axum::extract::{FromRequest, FromRequestParts, Path, Request};
use axum::http::request::Parts;
use axum::http::{HeaderMap, header};
use http_body_util::{BodyExt as _, LengthLimitError, Limited};
use serde::de::DeserializeOwned;

use crate::limits::{JSON_BODY_LIMIT_BYTES, JSON_BODY_TIMEOUT, MODEL_BODY_TIMEOUT};
use crate::problem::{Problem, ProblemKind};
use crate::rest::around::objects_only::objects_only;
use crate::rest::idempotency::fingerprint;
use crate::typed_json::{PathError, typed};
use app::hash_hex;

/// A JSON body with its hash; a larger one than usual has the time of an upload.
pub struct ApiJson<T, const LIMIT_BYTES: usize = JSON_BODY_LIMIT_BYTES> {
    /// The body.
    pub value: T,
    /// SHA-256 of its bytes, and of the query if there is one, hexadecimal.
    pub sha256: String,
    /// SHA-256 of its bytes alone, where the query does not change what is done.
    pub body_sha256: String,
}

/// A query.
pub struct ApiQuery<T>(pub T);

/// A path.
pub struct ApiPath<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned, const LIMIT_BYTES: usize> FromRequest<S> for ApiJson<T, LIMIT_BYTES> {
    type Rejection = Problem;

    async fn from_request(request: Request, _state: &S) -> Result<Self, Problem> {
        expect_json(request.headers())?;
        let query = request.uri().query().map(str::to_owned);
        let timeout = if LIMIT_BYTES > JSON_BODY_LIMIT_BYTES { MODEL_BODY_TIMEOUT } else { JSON_BODY_TIMEOUT };
        let bytes = whole_body(request.into_body(), LIMIT_BYTES, timeout).await?;
        let body_sha256 = hash_hex(&bytes);
        let sha256 = fingerprint(body_sha256.clone(), query.as_deref());
        Ok(Self { value: parse(&bytes)?, sha256, body_sha256 })
    }
}

fn expect_json(headers: &HeaderMap) -> Result<(), Problem> {
    let media = media_type(headers);
    if media.as_deref() == Some("application/json") {
        return Ok(());
    }
    let got = media.map_or_else(|| "no Content-Type".to_owned(), |media| format!("Content-Type {media}"));
    Err(Problem::new(ProblemKind::UnsupportedMediaType, format!("the request has {got}"))
        .remedy("send JSON with Content-Type: application/json"))
}

/// The media type of the body, without parameters, in lower case.
pub fn media_type(headers: &HeaderMap) -> Option<String> {
    let text = headers.get(header::CONTENT_TYPE)?.to_str().ok()?;
    Some(text.split(';').next().unwrap_or_default().trim().to_ascii_lowercase())
}

/// The whole of a body within the size limit.
pub async fn whole_body(body: Body, limit_bytes: usize, timeout: Duration) -> Result<Vec<u8>, Problem> {
    let read = tokio::time::timeout(timeout, Limited::new(body, limit_bytes).collect());
    match read.await {
        Ok(Ok(collected)) => Ok(collected.to_bytes().into()),
        Ok(Err(error)) if error.is::<LengthLimitError>() => {
            Err(Problem::new(ProblemKind::TooLarge, format!("the body has more than {limit_bytes} bytes"))
                .remedy("no request needs that many; see the API document"))
        }
        Ok(Err(error)) => {
            Err(Problem::new(ProblemKind::BadRequest, "the body was cut off").because(error.to_string()))
        }
        Err(_) => Err(Problem::new(
            ProblemKind::TimedOut,
            format!("the body did not arrive within {} s", timeout.as_secs()),
        )),
    }
}

/// Parses JSON; errors name the place.
fn parse<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Problem> {
    let plain = serde_json::from_slice(bytes).map_err(|error| not_json(&error))?;
    // From the bytes, since the plain value has lost the keys that are given twice.
    let value = typed(&mut serde_json::Deserializer::from_slice(bytes)).map_err(|error| invalid_field(&error))?;
    objects_only::<T>(plain).map_err(|error| invalid_field(&error))?;
    Ok(value)
}

fn invalid_field(error: &PathError) -> Problem {
    let text = error.inner().to_string();
    let what = text.split(" at line ").next().unwrap_or_default();
    Problem::new(ProblemKind::Impossible, what)
        .at(pointer(error.path()))
        .remedy("see the API document for what is expected")
}

fn not_json(error: &serde_json::Error) -> Problem {
    Problem::new(ProblemKind::BadRequest, format!("the body is not JSON: {error}")).remedy("send one JSON value")
}

/// A JSON pointer (RFC 6901); the whole document is `/`.
fn pointer(path: &serde_path_to_error::Path) -> String {
    use serde_path_to_error::Segment;
    let parts = path.iter().map(|segment| match segment {
        Segment::Seq { index } => format!("/{index}"),
        Segment::Map { key } => format!("/{}", key.replace('~', "~0").replace('/', "~1")),
        Segment::Enum { variant } => format!("/{variant}"),
        Segment::Unknown => String::new(),
    });
    let pointer: String = parts.collect();
    if pointer.is_empty() { "/".to_owned() } else { pointer }
}

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for ApiQuery<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Problem> {
        let query = axum::extract::Query::<T>::try_from_uri(&parts.uri).map_err(|rejection| {
            let text = rejection.body_text();
            let what = text.trim_start_matches("Failed to deserialize query string: ").to_owned();
            Problem::new(ProblemKind::BadRequest, what)
                .at("query")
                .remedy("see the API document for the parameters")
        })?;
        Ok(Self(query.0))
    }
}

impl<S: Send + Sync, T: DeserializeOwned + Send> FromRequestParts<S> for ApiPath<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let path = Path::<T>::from_request_parts(parts, state)
            .await
            .map_err(|rejection| Problem::new(ProblemKind::BadRequest, rejection.body_text()).at("path"))?;
        Ok(Self(path.0))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Outer {
        inner: Option<Inner>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Inner {
        step_mm: f64,
    }

    #[track_caller]
    fn check(body: &str, status: u16, place: Option<&str>, words: &str) {
        let problem = parse::<Outer>(body.as_bytes()).unwrap_err();
        assert_eq!((problem.status, problem.pointer.as_deref()), (status, place), "{problem:?}");
        assert!(problem.detail.contains(words), "{problem:?}");
    }

    #[test]
    fn a_parse_error_names_its_place() {
        check(r#"{"inner":{"step_mm":"wide"}}"#, 422, Some("/inner/step_mm"), "expected f64");
        check(r#"{"inner":{"step_mm":1,"speed":2}}"#, 422, Some("/inner/speed"), "unknown field `speed`");
        check(r#"{"outer":1}"#, 422, Some("/outer"), "unknown field `outer`");
        check(r#"{"inner":{}}"#, 422, Some("/inner"), "missing field `step_mm`");
        check(r#"{"inner":"#, 400, None, "not JSON");
        check("{} {}", 400, None, "not JSON");
        check("[]", 422, Some("/"), "");
        check("[null]", 422, Some("/"), "expected an object");
        check("[[1.0]]", 422, Some("/"), "expected an object");
        check(r#"{"inner":[1.0]}"#, 422, Some("/inner"), "expected an object");
    }

    #[test]
    fn an_array_is_refused_for_an_object_and_accepted_for_an_array() {
        #[derive(Debug, Deserialize)]
        #[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
        #[allow(dead_code)]
        enum Source {
            Station,
            Capture { range_mm: [f64; 2], orders: Vec<i8> },
        }
        parse::<Source>(br#"{"kind":"station"}"#).unwrap();
        parse::<Source>(br#"{"kind":"capture","range_mm":[1,2.5],"orders":[-1,0]}"#).unwrap();
        parse::<Vec<(String, Option<u8>)>>(br#"[["a",1],["b",null]]"#).unwrap();
        let problem = parse::<Source>(br#"["station"]"#).unwrap_err();
        assert!(problem.detail.contains("expected an object"), "{problem:?}");
    }
}
