//! The control lease: one holder at a time, five seconds long, renewed by its holder, taken over only explicitly. It
//! expires two minutes after the last command even if it is renewed.

use std::sync::Arc;
use std::time::Instant;

use station::StopEpoch;
use tokio::sync::watch;
use uuid::Uuid;

use crate::access::lease::Authority;
use crate::config::limits::{CONTROL_IDLE, CONTROL_LEASE};
use crate::error::{AppError, ErrorKind};

/// The relation of the caller to the control lease.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Caller {
    /// The holder.
    Holder,
    /// Anyone, while no one is in control.
    NoHolder,
    /// Anyone else, while someone is in control.
    OtherHolder,
}

/// A valid lease.
#[derive(Debug, Clone, PartialEq)]
pub struct Lease {
    /// Secret id: knowing it grants control.
    pub id: String,
    /// Display name of the holder.
    pub holder: String,
    /// Expiry unless renewed.
    pub ends_at: Instant,
    /// Time of the last command under it.
    commanded_at: Instant,
    /// Whether its expiry was published; the lease is kept so that its holder gets "expired".
    collected: bool,
}

impl Lease {
    fn runs(&self, now: Instant) -> bool {
        self.ends_at > now
    }

    /// Extends by five seconds, but not beyond the idle limit.
    fn renewed(&mut self, now: Instant) {
        self.ends_at = (now + CONTROL_LEASE).min(self.commanded_at + CONTROL_IDLE);
    }
}

/// A newly taken lease.
#[derive(Debug, Clone, PartialEq)]
pub struct Taken {
    /// The new lease.
    pub lease: Lease,
    /// The previous holder, if taken over.
    pub from: Option<String>,
}

/// The single control lease of the station. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct ControlDesk(Arc<watch::Sender<Option<Lease>>>);

impl ControlDesk {
    /// Takes control if no one has it, or takes it over if that is requested explicitly.
    pub fn take(&self, holder: &str, take_over: bool, now: Instant) -> Result<Taken, AppError> {
        let id = Uuid::new_v4().to_string();
        let lease = Lease {
            id,
            holder: holder.to_owned(),
            ends_at: now + CONTROL_LEASE,
            commanded_at: now,
            collected: false,
        };
        let mut from = None;
        let taken = self.0.send_if_modified(|desk| {
            from = desk.as_ref().filter(|present| present.runs(now)).map(|present| present.holder.clone());
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

    /// The current holder.
    pub fn present(&self, now: Instant) -> Option<Lease> {
        self.0.borrow().clone().filter(|lease| lease.runs(now))
    }

    /// Notifies of every change except the expiry of a lease, which only the clock causes.
    pub fn watch(&self) -> watch::Receiver<Option<Lease>> {
        self.0.subscribe()
    }

    /// Renews the lease for five seconds.
    ///
    /// # Errors
    /// `control-required` if someone else or no one is in control, `control-expired` if this lease has expired.
    pub fn renew(&self, id: Option<&str>, now: Instant) -> Result<Lease, AppError> {
        self.hold(id, now, |_| {})
    }

    /// Renews the lease for a command, which also resets the idle limit.
    ///
    /// # Errors
    /// As [`ControlDesk::renew`].
    pub fn command(&self, id: Option<&str>, now: Instant) -> Result<Lease, AppError> {
        self.hold(id, now, |lease| lease.commanded_at = now)
    }

    fn hold(&self, id: Option<&str>, now: Instant, note: impl Fn(&mut Lease)) -> Result<Lease, AppError> {
        let mut held = Err(nobody());
        self.0.send_if_modified(|desk| {
            held = match desk.as_mut() {
                Some(lease) if Some(lease.id.as_str()) == id => match lease.runs(now) {
                    true => {
                        note(lease);
                        lease.renewed(now);
                        Ok(lease.clone())
                    }
                    false => Err(expired()),
                },
                Some(lease) if lease.runs(now) => Err(controlled_by(&lease.holder)),
                _ => Err(nobody()),
            };
            held.is_ok()
        });
        held
    }

    /// The relation of a caller with the lease `id`.
    pub fn caller(&self, id: Option<&str>, now: Instant) -> Caller {
        match self.present(now) {
            None => Caller::NoHolder,
            Some(lease) if Some(lease.id.as_str()) == id => Caller::Holder,
            Some(_) => Caller::OtherHolder,
        }
    }

    /// The authority for a job of a caller with the lease `id`.
    pub fn authority(&self, id: Option<&str>, epoch: StopEpoch, now: Instant) -> Authority {
        let own = self.present(now).filter(|lease| Some(lease.id.as_str()) == id);
        Authority { holder: own.map(|lease| lease.holder), epoch }
    }

    /// Returns the holder of an expired lease, once.
    pub fn collect_expired(&self, now: Instant) -> Option<Lease> {
        let mut expired = None;
        self.0.send_if_modified(|desk| {
            let ran_out = desk.as_ref().is_some_and(|lease| !lease.runs(now) && !lease.collected);
            if ran_out && let Some(lease) = desk {
                lease.collected = true;
                expired = Some(lease.clone());
            }
            ran_out
        });
        expired
    }

    /// Releases control and returns the lease; releasing a lease that is not held is not an error.
    pub fn give_back(&self, id: Option<&str>) -> Option<Lease> {
        let mut given_back = None;
        self.0.send_if_modified(|desk| {
            given_back = desk.take_if(|lease| Some(lease.id.as_str()) == id);
            given_back.is_some()
        });
        given_back
    }
}

/// The refusal while someone else is in control.
pub fn controlled_by(holder: &str) -> AppError {
    AppError::new(ErrorKind::ControlRequired, format!("{holder} is in control of the station"))
        .remedy("ask them, or take over with POST /api/v1/station/control {\"holder\":\"…\",\"take_over\":true}")
}

fn expired() -> AppError {
    AppError::new(ErrorKind::ControlExpired, "the control lease has expired")
        .remedy("take control again with POST /api/v1/station/control {\"holder\":\"…\"}")
}

/// The refusal of a command without a lease while no one is in control.
pub fn nobody() -> AppError {
    AppError::new(ErrorKind::ControlRequired, "the request carries no valid control lease").remedy(
        "take control with POST /api/v1/station/control {\"holder\":\"…\"}, send its id as Sheaf-Control, renew it",
    )
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn control_has_one_holder_until_it_expires_or_is_taken_over_explicitly() {
        let (desk, now) = (ControlDesk::default(), Instant::now());
        let anna = desk.take("Anna", false, now).unwrap();
        assert_eq!(anna.from, None);
        let refused = desk.take("Ben", false, now).unwrap_err();
        assert_eq!(
            (refused.kind, refused.detail.as_str()),
            (ErrorKind::ControlRequired, "Anna is in control of the station")
        );
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
    fn an_expired_lease_is_reported_as_expired_until_someone_takes_control() {
        let (desk, now) = (ControlDesk::default(), Instant::now());
        let anna = desk.take("Anna", false, now).unwrap().lease.id;
        let later = now + Duration::from_secs(6);
        let refused = desk.command(Some(&anna), later).unwrap_err();
        assert_eq!(refused.kind, ErrorKind::ControlExpired);
        assert_eq!(desk.collect_expired(later).map(|lease| lease.holder).as_deref(), Some("Anna"));
        assert_eq!(desk.collect_expired(later), None, "its expiry is published once");
        assert_eq!(desk.caller(Some(&anna), later), Caller::NoHolder);
        desk.take("Ben", false, later).unwrap();
        let refused = desk.command(Some(&anna), later).unwrap_err();
        assert_eq!(refused.detail, "Ben is in control of the station");
    }

    #[test]
    fn control_expires_two_minutes_after_the_last_command_even_if_renewed() {
        let (desk, begun) = (ControlDesk::default(), Instant::now());
        let anna = desk.take("Anna", false, begun).unwrap().lease.id;
        let at = |s: u64| begun + Duration::from_secs(s);
        (1..30).for_each(|n| drop(desk.renew(Some(&anna), at(4 * n)).unwrap()));
        desk.command(Some(&anna), at(119)).unwrap();
        (30..59).for_each(|n| drop(desk.renew(Some(&anna), at(4 * n)).unwrap()));
        let lapsed = desk.renew(Some(&anna), at(240)).unwrap_err();
        assert_eq!(lapsed.kind, ErrorKind::ControlExpired);
    }

    #[test]
    fn a_job_keeps_the_holder_it_was_accepted_under() {
        let (desk, now) = (ControlDesk::default(), Instant::now());
        let epoch = station::StopEpoch::default();
        let unattended = desk.authority(None, epoch, now);
        let anna = desk.take("Anna", false, now).unwrap().lease.id;
        assert!(!unattended.may_begin(Some("Anna")) && unattended.may_begin(None));
        let hers = desk.authority(Some(&anna), epoch, now);
        assert!(hers.may_begin(Some("Anna")) && hers.may_begin(None) && !hers.may_begin(Some("Ben")));
    }
}
