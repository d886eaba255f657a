//! The control lease in the headers of a request.

use std::time::Instant;

use axum::http::{HeaderMap, HeaderName};

use crate::edge::{Peer, source};
use crate::problem::Problem;
use crate::rest::answers::header_text;
use app::App;
use app::control::Ask;
use app::events::Act;
use app::labels::label;
use app::lease::{Authority, ControlDesk, Lease};
use axum::Extension;

/// The header that carries the lease's id.
pub const CONTROL_HEADER: HeaderName = HeaderName::from_static("sheaf-control");

/// The header that says who sends a request, for the log, where no lease says it: a name in UTF-8.
pub const ACTOR_HEADER: HeaderName = HeaderName::from_static("sheaf-actor");

/// Passes if the request carries the lease; a command renews it.
pub fn authorize(desk: &ControlDesk, headers: &HeaderMap) -> Result<Lease, Problem> {
    Ok(desk.command(header_text(headers, &CONTROL_HEADER)?.as_deref(), Instant::now())?)
}

/// What a log calls the sender of a request: the holder of the lease that came along, else the name it gives itself.
/// Neither is proven.
pub fn actor(desk: &ControlDesk, headers: &HeaderMap) -> String {
    let id = headers.get(CONTROL_HEADER).and_then(|id| id.to_str().ok());
    let present = desk.present(Instant::now()).filter(|lease| Some(lease.id.as_str()) == id);
    let holder = present.map(|lease| lease.holder);
    holder.or_else(|| own_name(headers)).unwrap_or_else(|| "rest".to_owned())
}

/// Who sends a request, and from where, for an event.
pub fn act(app: &App, headers: &HeaderMap, peer: Option<&Extension<Peer>>) -> Act {
    Act { actor: actor(&app.control, headers), source: source(peer) }
}

/// Asks whether a request may use the station.
///
/// # Errors
/// A problem that says why not.
pub fn admit(app: &App, headers: &HeaderMap, ask: Ask) -> Result<Authority, Problem> {
    Ok(app::control::admit(app, header_text(headers, &CONTROL_HEADER)?.as_deref(), ask)?)
}

/// The name that a request gives its sender, where it is one.
fn own_name(headers: &HeaderMap) -> Option<String> {
    let name = std::str::from_utf8(headers.get(ACTOR_HEADER)?.as_bytes()).ok()?;
    label(name, "").ok().map(|()| name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    #[test]
    fn a_log_names_the_holder_of_the_lease_else_the_name_that_came_along() {
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
}
