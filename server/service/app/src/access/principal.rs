//! On whose behalf something is done.

use crate::events::Act;

/// Who asks for something. Every use case that changes something takes one, and the log of events names it.
///
/// There is one kind so far, `local`: whoever reaches the service may use it, and what they call themselves is not
/// proven. Users with rights of their own would be another kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Principal {
    /// What the log calls them: the holder of the control lease that came along, else the name they give themselves.
    pub actor: String,
    /// From where: an address.
    pub source: String,
    /// Id of the control lease that came along.
    pub control_id: Option<String>,
}

impl Principal {
    /// The kind that the log names.
    pub const LOCAL: &'static str = "local";

    /// Somebody at this station.
    pub fn local(actor: &str, source: &str, control_id: Option<&str>) -> Self {
        Self { actor: actor.to_owned(), source: source.to_owned(), control_id: control_id.map(str::to_owned) }
    }

    /// As an event names them.
    pub fn act(&self) -> Act {
        Act { principal: Self::LOCAL.to_owned(), actor: self.actor.clone(), source: self.source.clone() }
    }
}
