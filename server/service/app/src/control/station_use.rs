//! The table of who may use the station, who waits and who is refused, also printed in `docs/station.md`. Stop is not
//! in it: it is always allowed.

use crate::access::lease::Caller;
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
pub enum Request {
    /// A single command: move, laser, live view, camera settings.
    Command,
    /// An image of a calibration session, with the laser.
    SessionImage,
    /// A job that needs the station.
    StartJob,
    /// Cancelling such a job.
    CancelJob,
    /// A reset: leaves Halted or acknowledges faults.
    Reset,
    /// Changing the scene of a simulated station, which needs no control, as placing a part by hand needs none.
    ChangeScene,
}

/// The decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Decision {
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

/// The decision for `caller` requesting `request` while the station is used for `station_use`.
pub fn rule(request: Request, caller: Caller, station_use: StationUse) -> Decision {
    use Refusal::{Busy, ControlRequired, Fault, Halted};
    let allowed = match (request, caller) {
        (_, Caller::Holder) | (Request::ChangeScene, _) => true,
        (Request::StartJob | Request::CancelJob, Caller::NoHolder) => true,
        (_, Caller::NoHolder | Caller::OtherHolder) => false,
    };
    if !allowed {
        return Decision::Refused(ControlRequired);
    }
    match (request, station_use) {
        (Request::Reset | Request::CancelJob, _) => Decision::Now,
        (Request::ChangeScene, StationUse::Job) => Decision::Refused(Busy),
        (Request::ChangeScene, _) => Decision::Now,
        (_, StationUse::Halted) => Decision::Refused(Halted),
        (_, StationUse::Fault) => Decision::Refused(Fault),
        (Request::StartJob, StationUse::Job) => Decision::Waits,
        (Request::Command | Request::SessionImage, StationUse::Job) => Decision::Refused(Busy),
        (_, StationUse::Free | StationUse::Live) => Decision::Now,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REQUESTS: [Request; 6] = [
        Request::Command,
        Request::SessionImage,
        Request::StartJob,
        Request::CancelJob,
        Request::Reset,
        Request::ChangeScene,
    ];

    /// The table of `docs/station.md`: one row per caller and use, one column per request.
    const DOCUMENT: &str = include_str!("../../../../docs/station.md");

    fn word(decision: Decision) -> &'static str {
        match decision {
            Decision::Now => "now",
            Decision::Waits => "waits",
            Decision::Refused(Refusal::ControlRequired) => "control",
            Decision::Refused(Refusal::Busy) => "busy",
            Decision::Refused(Refusal::Halted) => "halted",
            Decision::Refused(Refusal::Fault) => "fault",
        }
    }

    fn expected_row(caller: &str, station_use: &str) -> Vec<&'static str> {
        let begins = format!("| {caller} | {station_use} |");
        let row = DOCUMENT.lines().find_map(|line| line.strip_prefix(begins.as_str()));
        let row = row.unwrap_or_else(|| panic!("docs/station.md has no row {begins}"));
        row.trim_end_matches('|').split('|').map(str::trim).collect()
    }

    #[test]
    fn every_decision_matches_the_document() {
        for (caller, caller_text) in [
            (Caller::Holder, "in control"),
            (Caller::NoHolder, "nobody in control"),
            (Caller::OtherHolder, "another in control"),
        ] {
            for (station_use, use_word) in [
                (StationUse::Free, "free"),
                (StationUse::Live, "live view"),
                (StationUse::Job, "job or session image"),
                (StationUse::Halted, "halted"),
                (StationUse::Fault, "fault"),
            ] {
                let decided: Vec<_> =
                    REQUESTS.iter().map(|request| word(rule(*request, caller, station_use))).collect();
                assert_eq!(decided, expected_row(caller_text, use_word), "{caller_text}, {use_word}");
            }
        }
    }
}
