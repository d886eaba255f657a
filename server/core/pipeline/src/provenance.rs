//! The calibration embedded in a cloud, so that the cloud can be measured with full uncertainty years later.
//!
//! The part of the calibration document needed to use it is split into comment lines `calibration_json i/n …` of the
//! cloud's header. The lines are plain ASCII and neither begin nor end with a blank, because readers trim comments.

use calibration::CalibrationDocument;
use calibration::document::CalibrationText;
use scanning::Cloud;

use crate::failure::Failure;

/// Key of the lines.
const KEY: &str = "calibration_json";

/// Bytes of JSON per line: short enough for any reader of headers.
const CHUNK_BYTES: usize = 900;

/// Adds software version, scan name and the calibration to the comments.
pub fn embed(comments: &mut Vec<String>, document: &CalibrationDocument, scan: &str) {
    comments.push(format!("software sheaf {}", env!("CARGO_PKG_VERSION")));
    comments.push(format!("scan {}", scan.escape_default()));
    let json = compact_ascii(&serde_json::to_string(&document.calibration).unwrap_or_default());
    let chunks = chunks(&json);
    let n_chunks = chunks.len();
    comments.extend(chunks.iter().enumerate().map(|(idx, chunk)| format!("{KEY} {}/{n_chunks} {chunk}", idx + 1)));
}

/// The embedded calibration, checked against the id stated in the cloud; `None` if the cloud has none.
pub fn extract(cloud: &Cloud) -> Result<Option<CalibrationText>, Failure> {
    let mut text = String::new();
    let mut expected = 1;
    let mut total = 0;
    for line in cloud.comments.iter().filter_map(|line| line.strip_prefix(KEY)) {
        let (place, chunk) = line.trim_start().split_once(' ').ok_or_else(damaged)?;
        let (idx, n_chunks) = place.split_once('/').ok_or_else(damaged)?;
        let (idx, n_chunks): (usize, usize) =
            (idx.parse().map_err(|_| damaged())?, n_chunks.parse().map_err(|_| damaged())?);
        if idx != expected || (total != 0 && n_chunks != total) {
            return Err(damaged());
        }
        (expected, total) = (expected + 1, n_chunks);
        text.push_str(chunk);
    }
    if total == 0 {
        return Ok(None);
    }
    if expected != total + 1 {
        return Err(damaged());
    }
    let calibration = CalibrationText::parse(&text).map_err(|error| damaged().because(&error))?;
    let stated = cloud.comments.iter().find_map(|line| line.strip_prefix("calibration "));
    if stated.is_some_and(|stated| stated.trim() != calibration.id) {
        return Err(damaged());
    }
    Ok(Some(calibration))
}

fn damaged() -> Failure {
    Failure::bad_input("the calibration in the cloud's header is damaged")
        .at_entry(format!("comments {KEY}"))
        .remedy("scan again, or give the calibration with --calibration")
}

/// JSON without blanks between its tokens and without characters beyond ASCII.
fn compact_ascii(json: &str) -> String {
    let mut compact = String::with_capacity(json.len());
    let (mut in_string, mut escaped) = (false, false);
    for character in json.chars() {
        if !in_string && character.is_ascii_whitespace() {
            continue;
        }
        if in_string && !escaped && character == '\\' {
            escaped = true;
        } else {
            in_string ^= character == '"' && !escaped;
            escaped = false;
        }
        if character.is_ascii() {
            compact.push(character);
        } else {
            for unit in character.encode_utf16(&mut [0; 2]) {
                compact.push_str(&format!("\\u{unit:04x}"));
            }
        }
    }
    compact
}

fn chunks(ascii: &str) -> Vec<&str> {
    let mut rest = ascii;
    let mut chunks = Vec::new();
    while !rest.is_empty() {
        let mut end = CHUNK_BYTES.min(rest.len());
        while end < rest.len() && (rest.as_bytes()[end - 1] == b' ' || rest.as_bytes()[end] == b' ') {
            end += 1;
        }
        let (chunk, tail) = rest.split_at(end);
        chunks.push(chunk);
        rest = tail;
    }
    chunks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compacting_keeps_the_meaning_of_the_json() {
        let json = "{ \"a\" : [1, 2.5e-3],\n \"µ \\\" b\\\\\" : \"x  y – 𝛌\" }";
        let compact = compact_ascii(json);
        assert!(compact.is_ascii() && !compact.contains(" :"));
        let value = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
        assert_eq!(value(&compact), value(json));
    }

    #[test]
    fn chunks_are_joined_and_survive_trimming() {
        let text = "ab  cd ".repeat(700);
        let text = text.trim();
        let chunks = chunks(text);
        assert!(chunks.len() > 3);
        assert!(chunks.iter().all(|chunk| chunk.trim().len() == chunk.len()));
        assert_eq!(chunks.concat(), text);
    }
}
