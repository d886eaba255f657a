//! The authority under which a job uses the station.

use station::StopEpoch;

/// The authority under which a job uses the station, held from acceptance until it has the station.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Authority {
    /// Who was in control when it was accepted; `None`: no one.
    pub holder: Option<String>,
    /// A later Stop revokes the authority.
    pub epoch: StopEpoch,
}

impl Authority {
    /// Whether a job may start while `in_control` is in control: no one, or the holder under whom it was accepted.
    pub fn may_begin(&self, in_control: Option<&str>) -> bool {
        in_control.is_none_or(|present| self.holder.as_deref() == Some(present))
    }
}
