//! On whose behalf something is done.

use crate::events::Initiator;

/// The caller of a use case. Every use case whose change is stored takes one, and the event log names it.
///
/// There is one kind so far, `local`: anyone who can reach the service may use it, and their name is not verified. Users
/// with individual rights would be another kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Principal {
    /// Name for the log: the holder of the control lease sent along, else the name given by the caller.
    pub actor: String,
    /// Network address.
    pub source: String,
    /// Id of the control lease sent along.
    pub control_id: Option<String>,
}

impl Principal {
    /// The kind as named in the log.
    pub const LOCAL: &'static str = "local";

    /// A local user of this station.
    pub fn local(actor: &str, source: &str, control_id: Option<&str>) -> Self {
        Self { actor: actor.to_owned(), source: source.to_owned(), control_id: control_id.map(str::to_owned) }
    }

    /// The initiator fields of an event.
    pub fn initiator(&self) -> Initiator {
        Initiator { principal: Self::LOCAL.to_owned(), actor: self.actor.clone(), source: self.source.clone() }
    }
}
