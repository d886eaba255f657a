//! One commander: the control lease, five seconds long, renewed by who holds it, taken over only explicitly.

use std::sync::Arc;
use std::time::Instant;

use axum::http::{HeaderMap, HeaderName};
use tokio::sync::watch;
use uuid::Uuid;

use crate::config::limits::CONTROL_LEASE;
use crate::http::answers::header_text;
use crate::http::conversions::label;
use crate::problem::{Problem, ProblemKind};

/// The header that carries the lease's id.
pub const CONTROL_HEADER: HeaderName = HeaderName::from_static("sheaf-control");

/// The header that says who sends a request, for the log, where no lease says it: a name in UTF-8.
pub const ACTOR_HEADER: HeaderName = HeaderName::from_static("sheaf-actor");

/// A lease that runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Lease {
    /// Its secret: whoever knows it commands.
    pub id: String,
    /// Who has it, for people.
    pub holder: String,
    /// When it ends, unless renewed.
    pub ends_at: Instant,
}

/// How a lease came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Taken {
    /// The new lease.
    pub lease: Lease,
    /// From whom it was taken over.
    pub from: Option<String>,
}

/// The one lease there is. Clones are the same desk.
#[derive(Debug, Clone, Default)]
pub struct ControlDesk(Arc<watch::Sender<Option<Lease>>>);

impl ControlDesk {
    /// Takes control if it is free, or from somebody else if that is said explicitly.
    pub fn take(&self, holder: &str, take_over: bool, now: Instant) -> Result<Taken, Problem> {
        let id = Uuid::new_v4().to_string();
        let lease = Lease { id, holder: holder.to_owned(), ends_at: now + CONTROL_LEASE };
        let mut from = None;
        let taken = self.0.send_if_modified(|desk| {
            from = desk.as_ref().filter(|present| present.ends_at > now).map(|present| present.holder.clone());
            let taken = take_over || from.is_none();
            if taken {
                *desk = Some(lease.clone());
            }
            taken
        });
        match (taken, from) {
            (false, Some(holder)) => Err(controlled_by(&holder)),
            (_, from) => Ok(Taken { lease, from }),
        }
    }

    /// Who has control now.
    pub fn present(&self, now: Instant) -> Option<Lease> {
        self.0.borrow().clone().filter(|lease| lease.ends_at > now)
    }

    /// Tells of every change but the end of a lease that nobody renews: that comes with time alone.
    pub fn watch(&self) -> watch::Receiver<Option<Lease>> {
        self.0.subscribe()
    }

    /// Holds on for five more seconds.
    pub fn renew(&self, id: Option<&str>, now: Instant) -> Result<Lease, Problem> {
        let mut renewed = Err(nobody());
        self.0.send_if_modified(|desk| {
            renewed = match desk.as_mut().filter(|lease| lease.ends_at > now) {
                Some(lease) if Some(lease.id.as_str()) == id => {
                    lease.ends_at = now + CONTROL_LEASE;
                    Ok(lease.clone())
                }
                Some(lease) => Err(controlled_by(&lease.holder)),
                None => Err(nobody()),
            };
            renewed.is_ok()
        });
        renewed
    }

    /// Gives control back; giving back what one does not have is no error.
    pub fn give_back(&self, id: Option<&str>) {
        self.0.send_if_modified(|desk| desk.take_if(|lease| Some(lease.id.as_str()) == id).is_some());
    }

    /// Passes if the request carries the lease; a command renews it.
    pub fn authorize(&self, headers: &HeaderMap) -> Result<Lease, Problem> {
        let id = header_text(headers, &CONTROL_HEADER)?;
        self.renew(id.as_deref(), Instant::now())
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

/// The name that a request gives its sender, where it is one.
fn own_name(headers: &HeaderMap) -> Option<String> {
    let name = std::str::from_utf8(headers.get(ACTOR_HEADER)?.as_bytes()).ok()?;
    label(name, "").ok().map(|()| name.trim().to_owned())
}

fn controlled_by(holder: &str) -> Problem {
    Problem::new(ProblemKind::ControlRequired, format!("{holder} controls the station"))
        .remedy("ask, or take over with POST /api/v1/station/control {\"holder\":\"…\",\"take_over\":true}")
}

fn nobody() -> Problem {
    Problem::new(ProblemKind::ControlRequired, "the request carries no control lease that runs").remedy(
        "take control with POST /api/v1/station/control {\"holder\":\"…\"}, send its id as Sheaf-Control, renew it",
    )
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use axum::http::HeaderValue;

    use super::*;

    #[test]
    fn control_is_one_persons_until_it_ends_or_is_taken_over_explicitly() {
        let (desk, now) = (ControlDesk::default(), Instant::now());
        let anna = desk.take("Anna", false, now).unwrap();
        assert_eq!(anna.from, None);
        let refused = desk.take("Ben", false, now).unwrap_err();
        assert_eq!((refused.status, refused.detail.as_str()), (409, "Anna controls the station"));
        assert_eq!(desk.present(now).map(|lease| lease.holder).as_deref(), Some("Anna"));
        let ben = desk.take("Ben", true, now).unwrap();
        assert_eq!(ben.from.as_deref(), Some("Anna"));
        assert!(desk.renew(Some(&anna.lease.id), now).is_err());
        desk.renew(Some(&ben.lease.id), now + Duration::from_secs(4)).unwrap();
        assert!(desk.renew(Some(&ben.lease.id), now + Duration::from_secs(8)).is_ok());
        assert!(desk.renew(Some(&ben.lease.id), now + Duration::from_secs(14)).is_err());
        assert_eq!(desk.present(now + Duration::from_secs(14)), None);
    }

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
