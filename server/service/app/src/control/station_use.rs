//! The one table of who may use the station, who waits and who is refused. It is printed in `docs/station.md`. Stop is
//! not in it: it is refused to nobody.

use crate::access::lease::Asker;
use station::{MachineState, OperationalState, StationStatus};

/// What the station is used for at this moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StationUse {
    /// Nothing, or a motion by hand.
    Free,
    /// The live view.
    Live,
    /// A job, or a session's photograph, which holds it like a short job.
    Job,
    /// Stopped: motion and laser stay off until a reset.
    Halted,
    /// A fault waits for a person.
    Fault,
}

/// What somebody asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ask {
    /// A single command: move, light, live view, camera settings.
    Command,
    /// A picture of a calibration session, with light.
    Photograph,
    /// A job that needs the station.
    StartJob,
    /// The end of such a job.
    CancelJob,
    /// To leave Halted, or to acknowledge faults.
    Reset,
}

/// What follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ruling {
    /// It is done.
    Now,
    /// It is accepted and waits for its turn.
    Waits,
    /// It is not.
    Refused(Refusal),
}

/// Why not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// Only for whoever is in control.
    ControlRequired,
    /// The station is busy.
    Busy,
    /// The station was stopped.
    Halted,
    /// A fault waits for a person.
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

/// What follows when `asker` asks for `ask` while the station is used for `station_use`.
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

    /// The table of `docs/station.md`: one row an asker and a use, one word an ask.
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
    fn every_ruling_is_the_one_in_the_document() {
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
