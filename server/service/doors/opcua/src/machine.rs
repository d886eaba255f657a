//! The state machines of OPC 40100-1: states, and the transitions between them.
//!
//! The station may change between two states that have no transition in the standard: a job that begins before the
//! stage is homed, for example. Such a change is reported as the shortest sequence of transitions of the standard.

use std::collections::VecDeque;

use app::doors::MachineState::{self, Error, Halted, Preoperational};
use app::doors::OperationalState;

const INITIALIZED: MachineState = MachineState::Operational(OperationalState::Initialized);
const READY: MachineState = MachineState::Operational(OperationalState::Ready);
const SINGLE_EXECUTION: MachineState = MachineState::Operational(OperationalState::SingleExecution);
const CONTINUOUS_EXECUTION: MachineState = MachineState::Operational(OperationalState::ContinuousExecution);

/// The node of the state Operational, which contains the last four.
pub const OPERATIONAL_NODE: u32 = 5031;

/// Name of a state in its own state machine.
pub fn name(state: MachineState) -> &'static str {
    state.name().trim_start_matches("Operational.")
}

/// Node of a state in the namespace of Machine Vision.
pub fn node(state: MachineState) -> u32 {
    match state {
        Preoperational => 5028,
        Halted => 5029,
        Error => 5030,
        MachineState::Operational(OperationalState::Initialized) => 5056,
        MachineState::Operational(OperationalState::Ready) => 5057,
        MachineState::Operational(OperationalState::SingleExecution) => 5058,
        MachineState::Operational(OperationalState::ContinuousExecution) => 5059,
    }
}

/// A transition of the standard.
#[derive(Debug, PartialEq, Eq)]
pub struct Transition {
    /// Before.
    pub from: MachineState,
    /// After.
    pub to: MachineState,
    /// Its node in the namespace of Machine Vision.
    pub node: u32,
    /// Its name.
    pub name: &'static str,
}

const fn transition(from: MachineState, to: MachineState, node: u32, name: &'static str) -> Transition {
    Transition { from, to, node, name }
}

/// Transitions by Halt and Reset have those as their cause; all others are automatic.
const TRANSITIONS: [Transition; 24] = [
    transition(Preoperational, Halted, 5032, "PreoperationalToHalted"),
    transition(Preoperational, Error, 5034, "PreoperationalToErrorAuto"),
    transition(Preoperational, INITIALIZED, 5036, "PreoperationalToInitializedAuto"),
    transition(Halted, Preoperational, 5037, "HaltedToPreoperational"),
    transition(Error, Preoperational, 5039, "ErrorToPreoperational"),
    transition(Error, Halted, 5041, "ErrorToHalted"),
    transition(INITIALIZED, READY, 5061, "InitializedToReadyAuto"),
    transition(READY, INITIALIZED, 5063, "ReadyToInitializedAuto"),
    transition(READY, SINGLE_EXECUTION, 5065, "ReadyToSingleExecutionAuto"),
    transition(READY, CONTINUOUS_EXECUTION, 5067, "ReadyToContinuousExecutionAuto"),
    transition(SINGLE_EXECUTION, READY, 5070, "SingleExecutionToReadyAuto"),
    transition(CONTINUOUS_EXECUTION, READY, 5073, "ContinuousExecutionToReadyAuto"),
    transition(INITIALIZED, Preoperational, 5047, "OperationalToPreoperational"),
    transition(READY, Preoperational, 5047, "OperationalToPreoperational"),
    transition(SINGLE_EXECUTION, Preoperational, 5047, "OperationalToPreoperational"),
    transition(CONTINUOUS_EXECUTION, Preoperational, 5047, "OperationalToPreoperational"),
    transition(INITIALIZED, Halted, 5049, "OperationalToHalted"),
    transition(READY, Halted, 5049, "OperationalToHalted"),
    transition(SINGLE_EXECUTION, Halted, 5049, "OperationalToHalted"),
    transition(CONTINUOUS_EXECUTION, Halted, 5049, "OperationalToHalted"),
    transition(INITIALIZED, Error, 5051, "OperationalToErrorAuto"),
    transition(READY, Error, 5051, "OperationalToErrorAuto"),
    transition(SINGLE_EXECUTION, Error, 5051, "OperationalToErrorAuto"),
    transition(CONTINUOUS_EXECUTION, Error, 5051, "OperationalToErrorAuto"),
];

/// The shortest sequence of transitions between two states; empty if they are the same.
pub fn path(from: MachineState, to: MachineState) -> Vec<&'static Transition> {
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

    fn names(from: MachineState, to: MachineState) -> Vec<&'static str> {
        path(from, to).iter().map(|transition| transition.name).collect()
    }

    #[test]
    fn every_change_of_the_station_is_a_sequence_of_transitions() {
        for from in MachineState::ALL {
            for to in MachineState::ALL {
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
        assert_eq!(names(INITIALIZED, SINGLE_EXECUTION), ["InitializedToReadyAuto", "ReadyToSingleExecutionAuto"]);
        assert_eq!(names(SINGLE_EXECUTION, INITIALIZED), ["SingleExecutionToReadyAuto", "ReadyToInitializedAuto"]);
        assert_eq!(names(Halted, Preoperational), ["HaltedToPreoperational"]);
        assert_eq!(
            names(CONTINUOUS_EXECUTION, SINGLE_EXECUTION),
            ["ContinuousExecutionToReadyAuto", "ReadyToSingleExecutionAuto"]
        );
    }

    #[test]
    fn the_names_are_those_of_the_standard() {
        assert_eq!(
            MachineState::ALL.map(name),
            [
                "Preoperational",
                "Halted",
                "Error",
                "Initialized",
                "Ready",
                "SingleExecution",
                "ContinuousExecution",
            ]
        );
    }
}
