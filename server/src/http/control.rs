//! The control lease in the headers of a request.

use std::time::Instant;

use axum::http::{HeaderMap, HeaderName};
use station::{StationRefusal, StationStatus};

use crate::app::App;
use crate::control::{Ask, Asker, Authority, ControlDesk, Lease, Refusal, Ruling, StationUse, rule};
use crate::http::answers::header_text;
use crate::http::conversions::label;
use crate::problem::{Problem, ProblemKind};

/// The header that carries the lease's id.
pub const CONTROL_HEADER: HeaderName = HeaderName::from_static("sheaf-control");

/// The header that says who sends a request, for the log, where no lease says it: a name in UTF-8.
pub const ACTOR_HEADER: HeaderName = HeaderName::from_static("sheaf-actor");

impl ControlDesk {
    /// Passes if the request carries the lease; a command renews it.
    pub fn authorize(&self, headers: &HeaderMap) -> Result<Lease, Problem> {
        self.command(header_text(headers, &CONTROL_HEADER)?.as_deref(), Instant::now())
    }

    /// What a log calls the sender of a request: the holder of the lease that came along, else the name it gives
    /// itself. Neither is proven.
    pub fn actor(&self, headers: &HeaderMap) -> String {
        let id = headers.get(CONTROL_HEADER).and_then(|id| id.to_str().ok());
        let present = self.present(Instant::now()).filter(|lease| Some(lease.id.as_str()) == id);
        let holder = present.map(|lease| lease.holder);
        holder.or_else(|| own_name(headers)).unwrap_or_else(|| "rest".to_owned())
    }
}

/// Asks the table whether a request may use the station; a command of whoever is in control renews the lease.
///
/// # Errors
/// A problem that says why not; [`Ruling::Waits`] is no error.
pub fn admit(app: &App, headers: &HeaderMap, ask: Ask) -> Result<Authority, Problem> {
    let id = header_text(headers, &CONTROL_HEADER)?;
    let (id, now) = (id.as_deref(), Instant::now());
    let epoch = app.station.stop_epoch();
    let status = app.station.status();
    let asker = app.control.asker(id, now);
    if let Ruling::Refused(refusal) = rule(ask, asker, station_use(app, &status)) {
        return Err(match refusal {
            // Says as well whether the lease that came along has expired.
            Refusal::ControlRequired => app.control.command(id, now).err().unwrap_or_else(not_in_control),
            Refusal::Halted => StationRefusal::Halted.into(),
            Refusal::Busy => StationRefusal::Busy { activity: status.activity.clone() }.into(),
            Refusal::Fault => fault(&status),
        });
    }
    if asker == Asker::InControl {
        app.control.command(id, now)?;
    }
    Ok(app.control.authority(id, epoch, now))
}

/// A station whose latch is closed is halted, even where its thread has not said so yet, or is being reset.
fn station_use(app: &App, status: &StationStatus) -> StationUse {
    if app.station.is_halted() { StationUse::Halted } else { StationUse::from(status) }
}

fn not_in_control() -> Problem {
    Problem::new(ProblemKind::ControlRequired, "control changed hands at this moment").remedy("try again")
}

fn fault(status: &StationStatus) -> Problem {
    let (detail, remedy) = match status.faults.first() {
        Some(fault) => (fault.detail.clone(), fault.remedy.clone()),
        None => ("a device failed".to_owned(), "check the devices".to_owned()),
    };
    StationRefusal::InError { detail, remedy }.into()
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
            assert_eq!(desk.actor(&headers), expected, "{control} {name:?}");
        };
        check(&anna, b"Ben", "Anna");
        check("no lease", " J\u{fc}rgen ".as_bytes(), "J\u{fc}rgen");
        check("no lease", b"", "rest");
        check("no lease", b"\xff\xfe", "rest");
        check("no lease", &[b'n'; 200], "rest");
        assert_eq!(desk.actor(&HeaderMap::new()), "rest");
    }
}
