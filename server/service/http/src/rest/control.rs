//! The sender of a request: control lease and actor name from its headers, and its address.

use std::time::Instant;

use axum::extract::{FromRef, FromRequestParts};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName};

use crate::edge::{Peer, source};
use crate::problem::Problem;
use crate::rest::answers::header_text;
use app::App;
use app::labels::label;
use app::lease::ControlDesk;
use app::principal::Principal;

/// The header with the id of the lease.
pub const CONTROL_HEADER: HeaderName = HeaderName::from_static("sheaf-control");

/// The header with the sender's name (UTF-8), for the log, used where no lease gives one.
pub const ACTOR_HEADER: HeaderName = HeaderName::from_static("sheaf-actor");

/// The log's name for senders that give none.
pub const NAMELESS: &str = "rest";

/// The sender of a request, as the use cases take it.
pub struct By(pub Principal);

impl<S: Send + Sync> FromRequestParts<S> for By
where
    App: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        header_text(&parts.headers, &CONTROL_HEADER)?;
        Ok(Self(principal(&App::from_ref(state).control, &parts.headers, parts.extensions.get::<Peer>())))
    }
}

/// The one place where a request becomes a principal; never refuses, so that Stop can use it.
pub fn principal(desk: &ControlDesk, headers: &HeaderMap, peer: Option<&Peer>) -> Principal {
    let control_id = headers.get(CONTROL_HEADER).and_then(|id| id.to_str().ok());
    Principal::local(&actor(desk, headers), &source(peer), control_id)
}

/// The sender's name for the log: the holder of the lease sent with the request, else the name it gives.
/// Neither is verified.
fn actor(desk: &ControlDesk, headers: &HeaderMap) -> String {
    let id = headers.get(CONTROL_HEADER).and_then(|id| id.to_str().ok());
    let present = desk.present(Instant::now()).filter(|lease| Some(lease.id.as_str()) == id);
    let holder = present.map(|lease| lease.holder);
    holder.or_else(|| own_name(headers)).unwrap_or_else(|| NAMELESS.to_owned())
}

/// The sender's name from the request, if it is valid.
fn own_name(headers: &HeaderMap) -> Option<String> {
    let name = std::str::from_utf8(headers.get(ACTOR_HEADER)?.as_bytes()).ok()?;
    label(name, "").ok().map(|()| name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    #[test]
    fn the_log_names_the_holder_of_the_lease_else_the_name_in_the_request() {
        let desk = ControlDesk::default();
        let anna = desk.take("Anna", false, Instant::now()).unwrap().lease.id;
        let check = |control: &str, name: &[u8], expected: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(CONTROL_HEADER, control.parse().unwrap());
            headers.insert(ACTOR_HEADER, HeaderValue::from_bytes(name).unwrap());
            assert_eq!(actor(&desk, &headers), expected, "{control} {name:?}");
        };
        check(&anna, b"Ben", "Anna");
        check("no lease", " J\u{fc}rgen ".as_bytes(), "J\u{fc}rgen");
        check("no lease", b"", "rest");
        check("no lease", b"\xff\xfe", "rest");
        check("no lease", &[b'n'; 200], "rest");
        assert_eq!(actor(&desk, &HeaderMap::new()), "rest");
    }

    #[test]
    fn a_request_becomes_a_principal_with_name_address_and_lease() {
        let desk = ControlDesk::default();
        let mut headers = HeaderMap::new();
        headers.insert(ACTOR_HEADER, HeaderValue::from_static("Ben"));
        headers.insert(CONTROL_HEADER, HeaderValue::from_static("7"));
        let peer = Peer("10.0.0.9:4000".parse().unwrap());
        assert_eq!(principal(&desk, &headers, Some(&peer)), Principal::local("Ben", "10.0.0.9", Some("7")));
        assert_eq!(principal(&desk, &HeaderMap::new(), None), Principal::local(NAMELESS, "server", None));
        let initiator = Principal::local("Ben", "10.0.0.9", None).initiator();
        assert_eq!((initiator.principal.as_str(), initiator.actor.as_str()), ("local", "Ben"));
    }
}
