//! Exit codes, and failures as JSON.

use pipeline::{Failure, FailureKind};
use serde_json::{Value, json};

/// How a command ended; the number is the process's exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done; with a tolerance: OK.
    Done = 0,
    /// An internal error, or a failure of the machine.
    Internal = 1,
    /// Wrong usage of the command line.
    Usage = 2,
    /// A file is missing, damaged, malformed or of the wrong size.
    BadInput = 3,
    /// The data are insufficient for a result.
    Unobservable = 4,
    /// Measured; verdict NOT OK or INVALID.
    VerdictFail = 5,
    /// Measured; verdict UNDECIDED.
    VerdictUndecided = 6,
    /// Done, but parts of the recording are missing or unreadable.
    Lossy = 7,
}

impl From<FailureKind> for Exit {
    fn from(kind: FailureKind) -> Self {
        match kind {
            FailureKind::Internal | FailureKind::Cancelled => Self::Internal,
            FailureKind::BadParameter => Self::Usage,
            FailureKind::BadInput => Self::BadInput,
            FailureKind::Unobservable => Self::Unobservable,
        }
    }
}

/// The name of a failure's kind in JSON.
fn name(kind: FailureKind) -> &'static str {
    match kind {
        FailureKind::Internal | FailureKind::Cancelled => "internal",
        FailureKind::BadParameter => "usage",
        FailureKind::BadInput => "bad_input",
        FailureKind::Unobservable => "insufficient_data",
    }
}

/// A failure as JSON.
pub fn failure_json(failure: &Failure) -> Value {
    json!({ "problem": {
        "kind": name(failure.kind()),
        "exit_code": Exit::from(failure.kind()) as u8,
        "what": failure.what(),
        "file": failure.file(),
        "entry": failure.entry(),
        "causes": failure.causes(),
        "remedy": failure.advice(),
    }})
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_as_json_contains_its_exit_code() {
        let failure = Failure::bad_input("cannot read the image").remedy("capture it again");
        assert_eq!(failure_json(&failure)["problem"]["exit_code"], 3);
        assert_eq!(failure_json(&failure)["problem"]["kind"], "bad_input");
    }
}
