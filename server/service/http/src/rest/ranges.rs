//! Range requests for large files (RFC 9110 section 14), for programs that read an index first and then parts of the file.

use std::io::{Read as _, Seek as _, SeekFrom};

use app::error::AppError;
use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use bytes::Bytes;
use store::{ArtifactBytes, ArtifactId};

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{artifact, bytes, header_text};

/// Chunk size.
const STEP_BYTES: usize = 256 * 1024;

/// A parsed `Range` header.
#[derive(Debug, PartialEq, Eq)]
enum Wanted {
    /// The whole file: no range, or an invalid one, which may be ignored.
    Whole,
    /// First and last byte, both within the file.
    Part(u64, u64),
    /// Outside the file.
    Nowhere,
}

/// Parses one range; for several ranges the whole file is returned.
fn wanted(range: Option<&str>, size_bytes: u64) -> Wanted {
    let Some((first, last)) = range.and_then(|range| range.strip_prefix("bytes=")?.split_once('-')) else {
        return Wanted::Whole;
    };
    let number = |text: &str| text.trim().parse::<u64>();
    match (first.trim(), last.trim()) {
        ("", suffix) => match number(suffix) {
            Ok(0) => Wanted::Nowhere,
            Ok(_) if size_bytes == 0 => Wanted::Nowhere,
            Ok(n_bytes) => Wanted::Part(size_bytes.saturating_sub(n_bytes), size_bytes - 1),
            Err(_) => Wanted::Whole,
        },
        (first, last) => match (number(first), number(last)) {
            (Ok(first), _) if first >= size_bytes => Wanted::Nowhere,
            (Ok(first), Err(_)) if last.is_empty() => Wanted::Part(first, size_bytes - 1),
            (Ok(first), Ok(last)) if first <= last => Wanted::Part(first, last.min(size_bytes - 1)),
            _ => Wanted::Whole,
        },
    }
}

/// The bytes of an artifact whose parts carry their own checksums. The whole file is verified before it is sent; a range
/// is not, because that would require reading the whole file.
pub async fn ranged_artifact(
    app: &app::App,
    id: &ArtifactId,
    what: &str,
    media_type: &'static str,
    file_name: &str,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let damaged = |error| AppError::from(error).of_stored(what);
    let file = app.artifacts.bytes(id).await.map_err(damaged)?;
    let tag = format!("\"{}\"", id.as_str());
    let is_same = header_text(headers, &header::IF_RANGE)?.is_none_or(|of| of == tag);
    let range = header_text(headers, &header::RANGE)?.filter(|_| is_same);
    let size_bytes = file.size_bytes();
    let mut response = match wanted(range.as_deref(), size_bytes) {
        Wanted::Whole => artifact(app, id, what, media_type, Some(file_name)).await?,
        Wanted::Part(first, last) => {
            let mut response = bytes(media_type, Some(file_name), body_of(file, first, last));
            *response.status_mut() = StatusCode::PARTIAL_CONTENT;
            put(&mut response, header::CONTENT_RANGE, &format!("bytes {first}-{last}/{size_bytes}"));
            put(&mut response, header::CONTENT_LENGTH, &(last - first + 1).to_string());
            put(&mut response, header::ETAG, &tag);
            response
        }
        Wanted::Nowhere => {
            let detail = format!("the file has {size_bytes} bytes; the range lies outside it");
            let problem = Problem::new(ProblemKind::RangeNotSatisfiable, detail).at("Range");
            let mut response = problem.remedy("request a range within the file").into_response();
            put(&mut response, header::CONTENT_RANGE, &format!("bytes */{size_bytes}"));
            response
        }
    };
    put(&mut response, header::ACCEPT_RANGES, "bytes");
    Ok(response)
}

fn put(response: &mut Response, name: header::HeaderName, text: &str) {
    if let Ok(value) = HeaderValue::from_str(text) {
        response.headers_mut().insert(name, value);
    }
}

/// Reads chunk by chunk on blocking threads.
fn body_of(file: ArtifactBytes, first: u64, last: u64) -> Body {
    let steps = futures_util::stream::try_unfold((file, first), move |(mut file, at)| async move {
        let left = (last + 1).saturating_sub(at);
        if left == 0 {
            return Ok(None);
        }
        let read = move || {
            let mut buffer = vec![0; left.min(STEP_BYTES as u64) as usize];
            file.seek(SeekFrom::Start(at))?;
            file.read_exact(&mut buffer)?;
            let next = at + buffer.len() as u64;
            Ok::<_, std::io::Error>(Some((Bytes::from(buffer), (file, next))))
        };
        tokio::task::spawn_blocking(read).await.map_err(std::io::Error::other)?
    });
    Body::from_stream(steps)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_within_the_file_or_not_satisfiable() {
        for (range, expected) in [
            (None, Wanted::Whole),
            (Some("bytes=0-0"), Wanted::Part(0, 0)),
            (Some("bytes=90-"), Wanted::Part(90, 99)),
            (Some("bytes=-8"), Wanted::Part(92, 99)),
            (Some("bytes=-800"), Wanted::Part(0, 99)),
            (Some("bytes=10-1000"), Wanted::Part(10, 99)),
            (Some("bytes=100-"), Wanted::Nowhere),
            (Some("bytes=-0"), Wanted::Nowhere),
            (Some("bytes=9-3"), Wanted::Whole),
            (Some("bytes=0-1,5-6"), Wanted::Whole),
            (Some("lines=0-1"), Wanted::Whole),
            (Some("bytes=x-"), Wanted::Whole),
        ] {
            assert_eq!(wanted(range, 100), expected, "{range:?}");
        }
        assert_eq!(wanted(Some("bytes=0-"), 0), Wanted::Nowhere);
        assert_eq!(wanted(Some("bytes=-1"), 0), Wanted::Nowhere);
    }
}
