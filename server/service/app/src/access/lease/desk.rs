//! One commander: the control lease, five seconds long, renewed by who holds it, taken over only explicitly. It lapses
//! when nothing is commanded for two minutes, however faithfully it is renewed.

use std::sync::Arc;
use std::time::Instant;

use station::StopEpoch;
use tokio::sync::watch;
use uuid::Uuid;

use crate::access::lease::Authority;
use crate::config::limits::{CONTROL_IDLE, CONTROL_LEASE};
use crate::error::{AppError, ErrorKind};

/// Who asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Asker {
    /// Whoever is in control.
    InControl,
    /// Anybody, while nobody is in control.
    WhileNobodyIs,
    /// Anybody else, while somebody is.
    WhileAnotherIs,
}

/// A lease that runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Lease {
    /// Its secret: whoever knows it commands.
    pub id: String,
    /// Who has it, for people.
    pub holder: String,
    /// When it ends, unless renewed.
    pub ends_at: Instant,
    /// When something was commanded with it last.
    commanded_at: Instant,
    /// Whether its end was published; it is kept so that its holder is answered "expired".
    collected: bool,
}

impl Lease {
    fn runs(&self, now: Instant) -> bool {
        self.ends_at > now
    }

    /// Five more seconds, but not beyond the time without a command.
    fn renewed(&mut self, now: Instant) {
        self.ends_at = (now + CONTROL_LEASE).min(self.commanded_at + CONTROL_IDLE);
    }
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

    /// Who has control now.
    pub fn present(&self, now: Instant) -> Option<Lease> {
        self.0.borrow().clone().filter(|lease| lease.runs(now))
    }

    /// Tells of every change but the end of a lease that nobody renews: that comes with time alone.
    pub fn watch(&self) -> watch::Receiver<Option<Lease>> {
        self.0.subscribe()
    }

    /// Holds on for five more seconds.
    ///
    /// # Errors
    /// `control-required` if somebody else is in control or nobody is, `control-expired` if this very lease ran out.
    pub fn renew(&self, id: Option<&str>, now: Instant) -> Result<Lease, AppError> {
        self.hold(id, now, |_| {})
    }

    /// The same for a command, which keeps control from lapsing.
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

    /// Where somebody with the lease `id` stands.
    pub fn asker(&self, id: Option<&str>, now: Instant) -> Asker {
        match self.present(now) {
            None => Asker::WhileNobodyIs,
            Some(lease) if Some(lease.id.as_str()) == id => Asker::InControl,
            Some(_) => Asker::WhileAnotherIs,
        }
    }

    /// On whose word a job of somebody with the lease `id` uses the station.
    pub fn authority(&self, id: Option<&str>, epoch: StopEpoch, now: Instant) -> Authority {
        let own = self.present(now).filter(|lease| Some(lease.id.as_str()) == id);
        Authority { holder: own.map(|lease| lease.holder), epoch }
    }

    /// Takes a lease that ran out off the desk, once, and says whose it was.
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

    /// Gives control back and returns the lease; giving back what one does not have is no error.
    pub fn give_back(&self, id: Option<&str>) -> Option<Lease> {
        let mut given_back = None;
        self.0.send_if_modified(|desk| {
            given_back = desk.take_if(|lease| Some(lease.id.as_str()) == id);
            given_back.is_some()
        });
        given_back
    }
}

/// The refusal while somebody else is in control.
pub fn controlled_by(holder: &str) -> AppError {
    AppError::new(ErrorKind::ControlRequired, format!("{holder} is in control of the station"))
        .remedy("ask, or take over with POST /api/v1/station/control {\"holder\":\"…\",\"take_over\":true}")
}

fn expired() -> AppError {
    AppError::new(ErrorKind::ControlExpired, "the control lease has expired")
        .remedy("take control again with POST /api/v1/station/control {\"holder\":\"…\"}")
}

/// The refusal of a command without a lease while nobody is in control.
pub fn nobody() -> AppError {
    AppError::new(ErrorKind::ControlRequired, "the request carries no control lease that runs").remedy(
        "take control with POST /api/v1/station/control {\"holder\":\"…\"}, send its id as Sheaf-Control, renew it",
    )
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn control_is_one_persons_until_it_ends_or_is_taken_over_explicitly() {
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
    fn a_lease_that_ran_out_is_called_expired_until_somebody_takes_control() {
        let (desk, now) = (ControlDesk::default(), Instant::now());
        let anna = desk.take("Anna", false, now).unwrap().lease.id;
        let later = now + Duration::from_secs(6);
        let refused = desk.command(Some(&anna), later).unwrap_err();
        assert_eq!(refused.kind, ErrorKind::ControlExpired);
        assert_eq!(desk.collect_expired(later).map(|lease| lease.holder).as_deref(), Some("Anna"));
        assert_eq!(desk.collect_expired(later), None, "its end is published once");
        assert_eq!(desk.asker(Some(&anna), later), Asker::WhileNobodyIs);
        desk.take("Ben", false, later).unwrap();
        let refused = desk.command(Some(&anna), later).unwrap_err();
        assert_eq!(refused.detail, "Ben is in control of the station");
    }

    #[test]
    fn control_lapses_two_minutes_after_the_last_command_however_often_it_is_renewed() {
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
