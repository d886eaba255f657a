//! The table of who may use the station, who waits and who is refused, also printed in `docs/station.md`. Stop is not
//! in it: it is always allowed.

use crate::access::lease::Asker;
use station::{MachineState, OperationalState, StationStatus};

/// Current use of the station.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StationUse {
    /// None, or a manual motion.
    Free,
    /// The live view.
    Live,
    /// A job, or a session image capture, which holds the station like a short job.
    Job,
    /// Stopped: motion and laser stay off until a reset.
    Halted,
    /// A fault requires action.
    Fault,
}

/// A request to use the station.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ask {
    /// A single command: move, laser, live view, camera settings.
    Command,
    /// An image of a calibration session, with the laser.
    Photograph,
    /// A job that needs the station.
    StartJob,
    /// Cancelling such a job.
    CancelJob,
    /// A reset: leaves Halted or acknowledges faults.
    Reset,
}

/// The ruling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ruling {
    /// Allowed.
    Now,
    /// Accepted; waits for its turn.
    Waits,
    /// Refused.
    Refused(Refusal),
}

/// Reason of a refusal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// Only for the holder of control.
    ControlRequired,
    /// The station is busy.
    Busy,
    /// The station was stopped.
    Halted,
    /// A fault requires action.
    Fault,
}

impl From<&StationStatus> for StationUse {
    fn from(status: &StationStatus) -> Self {
        match status.state {
            MachineState::Halted => Self::Halted,
            MachineState::Error => Self::Fault,
            MachineState::Operational(OperationalState::SingleExecution) => Self::Job,
            MachineState::Operational(OperationalState::ContinuousExecution) => Self::Live,
            MachineState::Preoperational | MachineState::Operational(_) => Self::Free,
        }
    }
}

/// The ruling for `asker` requesting `ask` while the station is used for `station_use`.
pub fn rule(ask: Ask, asker: Asker, station_use: StationUse) -> Ruling {
    use Refusal::{Busy, ControlRequired, Fault, Halted};
    let allowed = match (ask, asker) {
        (_, Asker::InControl) => true,
        (Ask::StartJob | Ask::CancelJob, Asker::WhileNobodyIs) => true,
        (_, Asker::WhileNobodyIs | Asker::WhileAnotherIs) => false,
    };
    if !allowed {
        return Ruling::Refused(ControlRequired);
    }
    match (ask, station_use) {
        (Ask::Reset | Ask::CancelJob, _) => Ruling::Now,
        (_, StationUse::Halted) => Ruling::Refused(Halted),
        (_, StationUse::Fault) => Ruling::Refused(Fault),
        (Ask::StartJob, StationUse::Job) => Ruling::Waits,
        (Ask::Command | Ask::Photograph, StationUse::Job) => Ruling::Refused(Busy),
        (_, StationUse::Free | StationUse::Live) => Ruling::Now,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASKS: [Ask; 5] = [Ask::Command, Ask::Photograph, Ask::StartJob, Ask::CancelJob, Ask::Reset];

    /// The table of `docs/station.md`: one row per asker and use, one column per request.
    const DOCUMENT: &str = include_str!("../../../../docs/station.md");

    fn word(ruling: Ruling) -> &'static str {
        match ruling {
            Ruling::Now => "now",
            Ruling::Waits => "waits",
            Ruling::Refused(Refusal::ControlRequired) => "control",
            Ruling::Refused(Refusal::Busy) => "busy",
            Ruling::Refused(Refusal::Halted) => "halted",
            Ruling::Refused(Refusal::Fault) => "fault",
        }
    }

    fn expected_row(asker: &str, station_use: &str) -> Vec<&'static str> {
        let begins = format!("| {asker} | {station_use} |");
        let row = DOCUMENT.lines().find_map(|line| line.strip_prefix(begins.as_str()));
        let row = row.unwrap_or_else(|| panic!("docs/station.md has no row {begins}"));
        row.trim_end_matches('|').split('|').map(str::trim).collect()
    }

    #[test]
    fn every_ruling_matches_the_document() {
        for (asker, asker_word) in [
            (Asker::InControl, "in control"),
            (Asker::WhileNobodyIs, "while nobody is"),
            (Asker::WhileAnotherIs, "while another is"),
        ] {
            for (station_use, use_word) in [
                (StationUse::Free, "free"),
                (StationUse::Live, "live view"),
                (StationUse::Job, "job or photograph"),
                (StationUse::Halted, "halted"),
                (StationUse::Fault, "fault"),
            ] {
                let ruled: Vec<_> = ASKS.iter().map(|ask| word(rule(*ask, asker, station_use))).collect();
                assert_eq!(ruled, expected_row(asker_word, use_word), "{asker_word}, {use_word}");
            }
        }
    }
}
