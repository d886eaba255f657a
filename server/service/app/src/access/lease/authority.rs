//! On whose word a job uses the station.

use station::StopEpoch;

/// On whose word a job uses the station, kept from the moment it was accepted until it has the station.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Authority {
    /// Who was in control when it was accepted; `None`: nobody was.
    pub holder: Option<String>,
    /// A Stop after it ends its authority.
    pub epoch: StopEpoch,
}

impl Authority {
    /// Whether a job may begin while `in_control` is in control: nobody, or the person it was accepted under.
    pub fn may_begin(&self, in_control: Option<&str>) -> bool {
        in_control.is_none_or(|present| self.holder.as_deref() == Some(present))
    }
}
