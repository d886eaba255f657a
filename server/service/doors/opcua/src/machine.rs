//! The state machines of OPC 40100-1: states, and the transitions between them.
//!
//! The station may change between two states that have no transition in the standard: a job that begins before the
//! stage is homed, for example. Such a change is reported as the shortest sequence of transitions of the standard.

use std::collections::VecDeque;

/// A state, with its number in the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum State {
    /// Devices are being opened.
    Preoperational = 1,
    /// Stopped.
    Halted = 2,
    /// A fault must be acknowledged.
    Error = 3,
    /// Homing or calibration is missing.
    Initialized = 5,
    /// A scan can start.
    Ready = 6,
    /// A job runs.
    SingleExecution = 7,
    /// The live view runs.
    ContinuousExecution = 8,
}

use State::{ContinuousExecution, Error, Halted, Initialized, Preoperational, Ready, SingleExecution};

/// The node of the state Operational, which contains the last four.
pub const OPERATIONAL_NODE: u32 = 5031;

impl State {
    /// The state of this name; an unknown one is an error, in which nothing can be started.
    pub fn named(name: &str) -> Self {
        match name {
            "Preoperational" => Preoperational,
            "Halted" => Halted,
            "Operational.Initialized" => Initialized,
            "Operational.Ready" => Ready,
            "Operational.SingleExecution" => SingleExecution,
            "Operational.ContinuousExecution" => ContinuousExecution,
            _ => Error,
        }
    }

    /// Its name in the standard.
    pub fn name(self) -> &'static str {
        match self {
            Preoperational => "Preoperational",
            Halted => "Halted",
            Error => "Error",
            Initialized => "Initialized",
            Ready => "Ready",
            SingleExecution => "SingleExecution",
            ContinuousExecution => "ContinuousExecution",
        }
    }

    /// Its number.
    pub fn number(self) -> u32 {
        self as u32
    }

    /// Its node in the namespace of Machine Vision.
    pub fn node(self) -> u32 {
        match self {
            Preoperational => 5028,
            Halted => 5029,
            Error => 5030,
            Initialized => 5056,
            Ready => 5057,
            SingleExecution => 5058,
            ContinuousExecution => 5059,
        }
    }

    /// Whether it is a state within Operational.
    pub fn is_operational(self) -> bool {
        self.number() > 4
    }
}

/// A transition of the standard.
#[derive(Debug, PartialEq, Eq)]
pub struct Transition {
    /// Before.
    pub from: State,
    /// After.
    pub to: State,
    /// Its node in the namespace of Machine Vision.
    pub node: u32,
    /// Its name.
    pub name: &'static str,
}

const fn transition(from: State, to: State, node: u32, name: &'static str) -> Transition {
    Transition { from, to, node, name }
}

/// Transitions by Halt and Reset have those as their cause; all others are automatic.
const TRANSITIONS: [Transition; 24] = [
    transition(Preoperational, Halted, 5032, "PreoperationalToHalted"),
    transition(Preoperational, Error, 5034, "PreoperationalToErrorAuto"),
    transition(Preoperational, Initialized, 5036, "PreoperationalToInitializedAuto"),
    transition(Halted, Preoperational, 5037, "HaltedToPreoperational"),
    transition(Error, Preoperational, 5039, "ErrorToPreoperational"),
    transition(Error, Halted, 5041, "ErrorToHalted"),
    transition(Initialized, Ready, 5061, "InitializedToReadyAuto"),
    transition(Ready, Initialized, 5063, "ReadyToInitializedAuto"),
    transition(Ready, SingleExecution, 5065, "ReadyToSingleExecutionAuto"),
    transition(Ready, ContinuousExecution, 5067, "ReadyToContinuousExecutionAuto"),
    transition(SingleExecution, Ready, 5070, "SingleExecutionToReadyAuto"),
    transition(ContinuousExecution, Ready, 5073, "ContinuousExecutionToReadyAuto"),
    transition(Initialized, Preoperational, 5047, "OperationalToPreoperational"),
    transition(Ready, Preoperational, 5047, "OperationalToPreoperational"),
    transition(SingleExecution, Preoperational, 5047, "OperationalToPreoperational"),
    transition(ContinuousExecution, Preoperational, 5047, "OperationalToPreoperational"),
    transition(Initialized, Halted, 5049, "OperationalToHalted"),
    transition(Ready, Halted, 5049, "OperationalToHalted"),
    transition(SingleExecution, Halted, 5049, "OperationalToHalted"),
    transition(ContinuousExecution, Halted, 5049, "OperationalToHalted"),
    transition(Initialized, Error, 5051, "OperationalToErrorAuto"),
    transition(Ready, Error, 5051, "OperationalToErrorAuto"),
    transition(SingleExecution, Error, 5051, "OperationalToErrorAuto"),
    transition(ContinuousExecution, Error, 5051, "OperationalToErrorAuto"),
];

/// The shortest sequence of transitions between two states; empty if they are the same.
pub fn path(from: State, to: State) -> Vec<&'static Transition> {
    let mut paths = VecDeque::from([(from, Vec::new())]);
    let mut reached = vec![from];
    while let Some((at, path)) = paths.pop_front() {
        if at == to {
            return path;
        }
        for next in TRANSITIONS.iter().filter(|transition| transition.from == at) {
            if !reached.contains(&next.to) {
                reached.push(next.to);
                paths.push_back((next.to, [path.clone(), vec![next]].concat()));
            }
        }
    }
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATES: [State; 7] =
        [Preoperational, Halted, Error, Initialized, Ready, SingleExecution, ContinuousExecution];

    fn names(from: State, to: State) -> Vec<&'static str> {
        path(from, to).iter().map(|transition| transition.name).collect()
    }

    #[test]
    fn every_change_of_the_station_is_a_sequence_of_transitions() {
        for from in STATES {
            for to in STATES {
                let path = path(from, to);
                assert_eq!(path.is_empty(), from == to, "{from:?} to {to:?}");
                let mut at = from;
                for transition in path {
                    assert_eq!(transition.from, at);
                    at = transition.to;
                }
                assert_eq!(at, to, "{from:?} to {to:?}");
            }
        }
    }

    #[test]
    fn changes_without_a_transition_take_the_shortest_way() {
        assert_eq!(names(Initialized, SingleExecution), ["InitializedToReadyAuto", "ReadyToSingleExecutionAuto"]);
        assert_eq!(names(SingleExecution, Initialized), ["SingleExecutionToReadyAuto", "ReadyToInitializedAuto"]);
        assert_eq!(names(Halted, Preoperational), ["HaltedToPreoperational"]);
        assert_eq!(
            names(ContinuousExecution, SingleExecution),
            ["ContinuousExecutionToReadyAuto", "ReadyToSingleExecutionAuto"]
        );
    }

    #[test]
    fn names_of_the_station_are_those_of_the_standard() {
        assert_eq!(State::named("Operational.Ready"), Ready);
        assert_eq!(State::named("something else"), Error);
    }
}
