//! What the answer of a receiver means.

use std::io::Read;
use std::time::{Duration, SystemTime};

use app::doors::Undelivered;
use ureq::Body;
use ureq::http::header::{LOCATION, RETRY_AFTER};
use ureq::http::{HeaderMap, Response, StatusCode};

use crate::params::{ANSWER_LIMIT_BYTES, EXCERPT_CHARS};

/// Reads the answer and says what it means for the delivery.
pub fn outcome(answer: Response<Body>) -> Result<(), Undelivered> {
    let (head, mut body) = answer.into_parts();
    let text = excerpt(body.as_reader());
    meaning(head.status, &head.headers, &text, SystemTime::now())
}

/// The beginning of the answer, as one line. What cannot be read is left out: the status has been received.
fn excerpt(body: impl Read) -> String {
    let mut bytes = Vec::new();
    // An error leaves in `bytes` what was read before it.
    let _ = body.take(ANSWER_LIMIT_BYTES).read_to_end(&mut bytes);
    one_line(&String::from_utf8_lossy(&bytes))
}

/// Without control characters, and shortened.
fn one_line(text: &str) -> String {
    let words = text.split(|c: char| c.is_whitespace() || c.is_control()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join(" ").chars().take(EXCERPT_CHARS).collect()
}

fn meaning(status: StatusCode, headers: &HeaderMap, text: &str, now: SystemTime) -> Result<(), Undelivered> {
    if status.is_success() {
        return Ok(());
    }
    let mut reason = format!("the receiver answered {}", status.as_u16());
    if let Some(meaning) = status.canonical_reason() {
        reason = format!("{reason} {meaning}");
    }
    let location = headers.get(LOCATION).and_then(|location| location.to_str().ok());
    if let Some(location) = location.filter(|_| status.is_redirection()) {
        reason = format!("{reason}: redirects are not followed; it refers to {}", one_line(location));
    } else if !text.is_empty() {
        reason = format!("{reason}: {text}");
    }
    Err(match status {
        StatusCode::GONE => Undelivered::Closed(reason),
        StatusCode::TOO_MANY_REQUESTS
        | StatusCode::BAD_GATEWAY
        | StatusCode::SERVICE_UNAVAILABLE
        | StatusCode::GATEWAY_TIMEOUT => {
            Undelivered::Unreachable { reason, retry_after: retry_after(headers, now) }
        }
        _ => Undelivered::Refused(reason),
    })
}

/// The delay that the receiver asks for, as seconds or as a date.
fn retry_after(headers: &HeaderMap, now: SystemTime) -> Option<Duration> {
    let text = headers.get(RETRY_AFTER)?.to_str().ok()?.trim();
    match text.parse() {
        Ok(seconds) => Some(Duration::from_secs(seconds)),
        Err(_) => Some(httpdate::parse_http_date(text).ok()?.duration_since(now).unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Error, repeat};

    use ureq::http::HeaderValue;

    use super::*;

    fn headers(name: ureq::http::HeaderName, value: &str) -> HeaderMap {
        HeaderMap::from_iter([(name, HeaderValue::from_str(value).unwrap())])
    }

    fn answered(status: u16) -> Result<(), Undelivered> {
        meaning(StatusCode::from_u16(status).unwrap(), &HeaderMap::new(), "no such part", SystemTime::UNIX_EPOCH)
    }

    fn kind(status: u16) -> &'static str {
        match answered(status) {
            Ok(()) => "delivered",
            Err(Undelivered::Refused(_)) => "refused",
            Err(Undelivered::Unreachable { .. }) => "unreachable",
            Err(Undelivered::Closed(_)) => "closed",
            Err(Undelivered::Impossible(_)) => "impossible",
        }
    }

    #[test]
    fn each_status_has_the_meaning_of_standard_webhooks() {
        for (statuses, expected) in [
            (&[200, 201, 202, 204, 299][..], "delivered"),
            (&[101, 300, 301, 302, 303, 304, 307, 308], "refused"),
            (&[400, 401, 403, 404, 408, 409, 413, 422, 451, 500, 501, 505, 599, 600], "refused"),
            (&[429, 502, 503, 504], "unreachable"),
            (&[410], "closed"),
        ] {
            for status in statuses {
                assert_eq!(kind(*status), expected, "{status}");
            }
        }
    }

    #[test]
    fn a_refusal_names_the_status_and_the_answer() {
        let refused = answered(500).unwrap_err().to_string();
        assert_eq!(refused, "the receiver answered 500 Internal Server Error: no such part");
        assert_eq!(answered(599).unwrap_err().to_string(), "the receiver answered 599: no such part");
        let moved = meaning(
            StatusCode::PERMANENT_REDIRECT,
            &headers(LOCATION, "https://other.example/"),
            "moved",
            SystemTime::UNIX_EPOCH,
        );
        assert!(moved.unwrap_err().to_string().ends_with("refers to https://other.example/"));
    }

    #[test]
    fn a_receiver_asks_for_a_delay_in_seconds_or_until_a_date() {
        let now = SystemTime::UNIX_EPOCH + Duration::from_secs(784_111_777);
        for (value, expected_s) in [
            ("120", Some(120)),
            (" 0 ", Some(0)),
            ("Sun, 06 Nov 1994 08:50:37 GMT", Some(60)),
            ("Sun, 06 Nov 1994 08:48:37 GMT", Some(0)),
            ("soon", None),
            ("-1", None),
            ("1.5", None),
        ] {
            let asked = meaning(StatusCode::SERVICE_UNAVAILABLE, &headers(RETRY_AFTER, value), "", now);
            let Err(Undelivered::Unreachable { retry_after, .. }) = asked else { panic!("{asked:?}") };
            assert_eq!(retry_after, expected_s.map(Duration::from_secs), "{value}");
        }
    }

    #[test]
    fn the_excerpt_of_an_answer_is_one_short_line_without_control_characters() {
        let text = excerpt(Cursor::new("<p>\u{1b}[31mno\r\n\tpart\0 x\u{85}y</p>\u{7f}"));
        assert_eq!(text, "<p> [31mno part x y</p>");
        assert_eq!(excerpt(Cursor::new("ü".repeat(1000))), "ü".repeat(EXCERPT_CHARS));
        assert_eq!(excerpt(Cursor::new([b'a', 0xff, b'b'])), "a\u{fffd}b");
    }

    #[test]
    fn an_answer_is_read_to_the_limit_and_kept_if_it_breaks_off() {
        struct Counted(u64);
        impl Read for &mut Counted {
            fn read(&mut self, into: &mut [u8]) -> Result<usize, Error> {
                self.0 += into.len() as u64;
                repeat(b'x').read(into)
            }
        }
        let mut endless = Counted(0);
        assert_eq!(excerpt(&mut endless).len(), EXCERPT_CHARS);
        assert_eq!(endless.0, ANSWER_LIMIT_BYTES);

        struct BreaksOff(&'static [u8]);
        impl Read for BreaksOff {
            fn read(&mut self, into: &mut [u8]) -> Result<usize, Error> {
                match self.0.read(into)? {
                    0 => Err(Error::other("reset")),
                    n_bytes => Ok(n_bytes),
                }
            }
        }
        assert_eq!(excerpt(BreaksOff(b"half an ans")), "half an ans");
    }
}
