//! The states of OPC 40100-1 and their transitions, as a pure table.

use crate::shared::status::MachineState::{self, Error, Halted, Operational, Preoperational};
use crate::shared::status::OperationalState::{ContinuousExecution, Initialized, Ready, SingleExecution};

/// An event of the station.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Event {
    /// All devices respond.
    DevicesConnected,
    /// A device has not been connected.
    DeviceMissing,
    /// A scan can start: the stage is homed and a calibration is active.
    ScanPossible,
    /// The stage is not homed or no calibration is active.
    ScanNotPossible,
    /// A job acquires the station.
    JobBegins,
    /// The job releases the station.
    JobEnds,
    /// A live view starts.
    LiveBegins,
    /// The live view ends.
    LiveEnds,
    /// A person stops the station.
    Stop,
    /// A device failed.
    Fault,
    /// A person acknowledges the faults; devices are reconnected.
    Reset,
}

/// The state after `event`; `None` if it is refused. An event without meaning in a state leaves the state unchanged.
pub fn next(state: MachineState, event: Event) -> Option<MachineState> {
    match state {
        Preoperational => match event {
            Event::DevicesConnected => Some(Operational(Initialized)),
            Event::Fault => Some(Error),
            Event::Stop => Some(Halted),
            Event::JobBegins | Event::LiveBegins => None,
            _ => Some(Preoperational),
        },
        // A fault is recorded and shown; a person has to act in any case.
        Halted => match event {
            Event::Reset => Some(Preoperational),
            Event::JobBegins | Event::LiveBegins => None,
            _ => Some(Halted),
        },
        Error => match event {
            Event::Reset => Some(Preoperational),
            Event::Stop => Some(Halted),
            Event::JobBegins | Event::LiveBegins => None,
            _ => Some(Error),
        },
        Operational(within) => match (within, event) {
            (_, Event::Fault) => Some(Error),
            (_, Event::Stop) => Some(Halted),
            (SingleExecution, Event::JobBegins | Event::LiveBegins) => None,
            (SingleExecution, Event::JobEnds) => Some(Operational(Initialized)),
            (ContinuousExecution, Event::LiveEnds) => Some(Operational(Initialized)),
            (_, Event::Reset) => Some(Preoperational),
            (_, Event::JobBegins) => Some(Operational(SingleExecution)),
            (_, Event::LiveBegins) => Some(Operational(ContinuousExecution)),
            (Initialized, Event::ScanPossible) => Some(Operational(Ready)),
            (Ready, Event::ScanNotPossible) => Some(Operational(Initialized)),
            (same, _) => Some(Operational(same)),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATES: [MachineState; 7] = [
        Preoperational,
        Halted,
        Error,
        Operational(Initialized),
        Operational(Ready),
        Operational(SingleExecution),
        Operational(ContinuousExecution),
    ];
    const EVENTS: [Event; 11] = [
        Event::DevicesConnected,
        Event::DeviceMissing,
        Event::ScanPossible,
        Event::ScanNotPossible,
        Event::JobBegins,
        Event::JobEnds,
        Event::LiveBegins,
        Event::LiveEnds,
        Event::Stop,
        Event::Fault,
        Event::Reset,
    ];

    /// One line per state, one letter per event in the order of `EVENTS`: the next state; `-` refuses.
    const TABLE: [&str; 7] = [
        "IPPP-P-PHEP", // Preoperational
        "HHHH-H-HHHP", // Halted
        "EEEE-E-EHEP", // Error
        "IIRISICIHEP", // Initialized
        "RRRISRCRHEP", // Ready
        "SSSS-I-SHEP", // SingleExecution
        "CCCCSCCIHEP", // ContinuousExecution
    ];

    fn letter(state: Option<MachineState>) -> char {
        match state {
            None => '-',
            Some(Preoperational) => 'P',
            Some(Halted) => 'H',
            Some(Error) => 'E',
            Some(Operational(Initialized)) => 'I',
            Some(Operational(Ready)) => 'R',
            Some(Operational(SingleExecution)) => 'S',
            Some(Operational(ContinuousExecution)) => 'C',
        }
    }

    #[test]
    fn every_event_in_every_state_leads_where_the_table_says() {
        for (state, row) in STATES.into_iter().zip(TABLE) {
            let led: String = EVENTS.into_iter().map(|event| letter(next(state, event))).collect();
            assert_eq!(led, row, "from {state:?}");
        }
    }

    #[test]
    fn only_a_reset_leaves_halted_and_error_and_it_is_accepted_everywhere() {
        for event in EVENTS.into_iter().filter(|event| *event != Event::Reset) {
            assert!(matches!(next(Halted, event), None | Some(Halted)), "{event:?} left Halted");
            assert!(matches!(next(Error, event), None | Some(Error | Halted)), "{event:?} left Error");
        }
        for state in STATES {
            assert_eq!(next(state, Event::Reset), Some(Preoperational), "{state:?}");
            assert_eq!(next(state, Event::Stop), Some(Halted), "{state:?}");
        }
    }
}
