//! Range requests for large files (RFC 9110 section 14), for programs that read an index first and then parts of the file.

use std::io::{Read as _, Seek as _, SeekFrom};
use std::ops::RangeInclusive;

use app::error::AppError;
use axum::body::Body;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use bytes::Bytes;
use headers::{AcceptRanges, ContentLength, ContentRange, HeaderMapExt as _, IfRange};
use store::{ArtifactBytes, ArtifactId};

use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{artifact, bytes, header_text};
use crate::rest::etag::tag;

/// Chunk size.
const STEP_BYTES: usize = 256 * 1024;

/// A parsed `Range` header.
#[derive(Debug, PartialEq, Eq)]
enum Wanted {
    /// The whole file: no range, several ranges, or an invalid one, which may be ignored.
    Whole,
    /// These bytes, all within the file.
    Part(RangeInclusive<u64>),
    /// Outside the file.
    Nowhere,
}

/// Parses one range; for several ranges the whole file is returned. (The parser of tower-http refuses a suffix longer
/// than the file and accepts a range of an empty one.)
fn wanted(range: Option<&str>, size_bytes: u64) -> Wanted {
    let Some((first, last)) = range.and_then(|range| range.strip_prefix("bytes=")?.split_once('-')) else {
        return Wanted::Whole;
    };
    let number = |text: &str| text.trim().parse::<u64>();
    match (first.trim(), last.trim()) {
        ("", suffix) => match number(suffix) {
            Ok(0) => Wanted::Nowhere,
            Ok(_) if size_bytes == 0 => Wanted::Nowhere,
            Ok(n_bytes) => Wanted::Part(size_bytes.saturating_sub(n_bytes)..=size_bytes - 1),
            Err(_) => Wanted::Whole,
        },
        (first, last) => match (number(first), number(last)) {
            (Ok(first), _) if first >= size_bytes => Wanted::Nowhere,
            (Ok(first), Err(_)) if last.is_empty() => Wanted::Part(first..=size_bytes - 1),
            (Ok(first), Ok(last)) if first <= last => Wanted::Part(first..=last.min(size_bytes - 1)),
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
    let tag = tag(id.as_str());
    let is_same = headers.typed_get().is_none_or(|of: IfRange| !of.is_modified(tag.as_ref(), None));
    let range = header_text(headers, &header::RANGE)?.filter(|_| is_same);
    let size_bytes = file.size_bytes();
    let mut response = match wanted(range.as_deref(), size_bytes) {
        Wanted::Whole => artifact(app, id, what, media_type, Some(file_name)).await?,
        Wanted::Part(part) => {
            let mut response = bytes(media_type, Some(file_name), body_of(file, &part));
            *response.status_mut() = StatusCode::PARTIAL_CONTENT;
            let added = response.headers_mut();
            added.typed_insert(ContentLength(part.end() - part.start() + 1));
            if let Ok(place) = ContentRange::bytes(part, size_bytes) {
                added.typed_insert(place);
            }
            if let Some(tag) = tag {
                added.typed_insert(tag);
            }
            response
        }
        Wanted::Nowhere => {
            let detail = format!("the file has {size_bytes} bytes; the range lies outside it");
            let problem = Problem::new(ProblemKind::RangeNotSatisfiable, detail).at("Range");
            let mut response = problem.remedy("request a range within the file").into_response();
            response.headers_mut().typed_insert(ContentRange::unsatisfied_bytes(size_bytes));
            response
        }
    };
    response.headers_mut().typed_insert(AcceptRanges::bytes());
    Ok(response)
}

/// Reads chunk by chunk on blocking threads.
fn body_of(file: ArtifactBytes, part: &RangeInclusive<u64>) -> Body {
    let last = *part.end();
    let steps = futures_util::stream::try_unfold((file, *part.start()), move |(mut file, at)| async move {
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
            (Some("bytes=0-0"), Wanted::Part(0..=0)),
            (Some("bytes=90-"), Wanted::Part(90..=99)),
            (Some("bytes=-8"), Wanted::Part(92..=99)),
            (Some("bytes=-800"), Wanted::Part(0..=99)),
            (Some("bytes=10-1000"), Wanted::Part(10..=99)),
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
