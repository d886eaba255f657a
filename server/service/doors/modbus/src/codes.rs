//! Commands, codes and bits, with their numbers and meanings.

/// What a PLC can command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Command {
    /// Nothing.
    None,
    /// Inspect a part.
    Trigger,
    /// Cancel the inspection triggered last.
    Abort,
    /// Stop the station.
    Stop,
    /// Select a recipe for triggers without one.
    Prepare,
    /// Undo prepare.
    Unprepare,
}

impl Command {
    /// All commands, by number.
    pub const ALL: [Self; 6] =
        [Self::None, Self::Trigger, Self::Abort, Self::Stop, Self::Prepare, Self::Unprepare];

    /// The command with this number.
    pub fn numbered(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|one| u32::from(one.number()) == number)
    }

    /// Its number.
    pub fn number(self) -> u16 {
        self as u16
    }

    /// What it does.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::None => "nothing; accepted",
            Self::Trigger => "inspect the part with recipe and serial number of the registers, once",
            Self::Abort => "cancel the inspection triggered last, if it has not ended",
            Self::Stop => {
                "stop the station, in every state: motion and laser stay off until a person resets it; there is no command \
                 for that"
            }
            Self::Prepare => {
                "use the recipe of the register for triggers with recipe 0, until a restart of the server"
            }
            Self::Unprepare => "undo prepare",
        }
    }
}

/// Outcome of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AckCode {
    /// Accepted.
    Accepted,
    /// No such command.
    UnknownCommand,
    /// An inspection or another job runs.
    Busy,
    /// No such recipe.
    NoRecipe,
    /// The station is stopped.
    Stopped,
    /// The station is in error.
    Fault,
    /// Someone else is in control.
    NotInControl,
    /// The serial number or the order cannot be used.
    BadSerial,
    /// Too many results or jobs wait.
    QueueFull,
    /// The station is not ready.
    NotReady,
    /// Not executed after a start of the server.
    Restarted,
    /// The heartbeat of the PLC is silent.
    PlcSilent,
    /// The service cannot accept it.
    Unavailable,
}

impl AckCode {
    /// All codes, by number.
    pub const ALL: [Self; 13] = [
        Self::Accepted,
        Self::UnknownCommand,
        Self::Busy,
        Self::NoRecipe,
        Self::Stopped,
        Self::Fault,
        Self::NotInControl,
        Self::BadSerial,
        Self::QueueFull,
        Self::NotReady,
        Self::Restarted,
        Self::PlcSilent,
        Self::Unavailable,
    ];

    /// Its number.
    pub fn number(self) -> u16 {
        self as u16
    }

    /// Why.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::UnknownCommand => "there is no such command",
            Self::Busy => "busy: an inspection or another job is not finished",
            Self::NoRecipe => {
                "no recipe in use has this number, or matches the serial number, or this door does not use it"
            }
            Self::Stopped => "the station is stopped, and must be reset by a person",
            Self::Fault => "a fault must be acknowledged by a person, or a device did not take the command",
            Self::NotInControl => "someone else is in control of the station",
            Self::BadSerial => {
                "the serial number is empty, or it or the order is not UTF-8 or has control characters"
            }
            Self::QueueFull => "32 results are not acknowledged, or too many jobs wait",
            Self::NotReady => "the station is not ready: homing or calibration is missing",
            Self::Restarted => {
                "not executed: the first command_seq after a start of the server; repeat with another one"
            }
            Self::PlcSilent => "plc_heartbeat has not changed for 2 s",
            Self::Unavailable => {
                "the service cannot accept it, see its log: it starts, shuts down, or its disk is full"
            }
        }
    }
}

/// A bit of the status register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StatusBit {
    /// A trigger is accepted.
    Ready,
    /// An inspection or another job runs.
    Busy,
    /// A result waits for acknowledgement.
    Valid,
    /// A fault must be acknowledged.
    Fault,
    /// The station is stopped.
    StopLatched,
    /// Too many results wait.
    Overflow,
    /// Simulated devices.
    Simulated,
    /// The heartbeat of the PLC is seen.
    PlcAlive,
}

impl StatusBit {
    /// All bits, by number.
    pub const ALL: [Self; 8] = [
        Self::Ready,
        Self::Busy,
        Self::Valid,
        Self::Fault,
        Self::StopLatched,
        Self::Overflow,
        Self::Simulated,
        Self::PlcAlive,
    ];

    /// Its number.
    pub fn number(self) -> u16 {
        self as u16
    }

    /// What it says.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Ready => "ready: a trigger is accepted now",
            Self::Busy => "busy: an inspection or another job is not finished",
            Self::Valid => "valid: the result shown is not acknowledged yet; without writes: there is a result",
            Self::Fault => "fault: a person must acknowledge a fault",
            Self::StopLatched => "stopped: a person must reset the station",
            Self::Overflow => "overflow: more than 32 results wait; none is lost",
            Self::Simulated => {
                "simulated: the devices, or those of the result shown, are simulated; no verdict on a real part"
            }
            Self::PlcAlive => "plc alive: plc_heartbeat has changed within 2 s",
        }
    }
}

/// Why a request is refused, as a Modbus exception.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Exception {
    /// 1: no such function; or a write, and writes are off.
    Function,
    /// 2: no such register, or it cannot be written.
    Address,
    /// 3: a count of 0 or beyond what fits into a message, or a malformed request.
    Value,
}

impl Exception {
    /// Its number.
    pub fn number(self) -> u8 {
        match self {
            Self::Function => 1,
            Self::Address => 2,
            Self::Value => 3,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_contract() {
        let commands = Command::ALL.map(Command::number);
        assert_eq!(commands, [0, 1, 2, 3, 4, 5]);
        assert_eq!(Command::numbered(3), Some(Command::Stop));
        assert_eq!((Command::numbered(6), Command::numbered(u32::MAX)), (None, None));
        for (position, code) in (0..).zip(AckCode::ALL) {
            assert_eq!(code.number(), position);
        }
        for (position, bit) in (0..).zip(StatusBit::ALL) {
            assert_eq!(bit.number(), position);
        }
    }
}
