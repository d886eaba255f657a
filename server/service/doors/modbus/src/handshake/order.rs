//! Commands to be carried out, and their outcome.

use crate::line::TriggeredPart;

/// A command that the handshake has let pass.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Order {
    /// Its `command_seq`.
    pub seq: u16,
    /// What is to be done.
    pub task: Task,
}

/// What is to be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Task {
    /// Inspect a part.
    Trigger(TriggeredPart),
    /// Cancel this job.
    Abort {
        /// Its id.
        job_id: String,
    },
    /// Stop the station.
    Stop,
    /// Check that this recipe exists.
    Prepare {
        /// Its number.
        recipe: u32,
    },
}

/// The inspection triggered last, until it ends.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Inspection {
    /// None.
    #[default]
    None,
    /// Requested, not accepted yet.
    Requested {
        /// Whether it is to be cancelled once it is accepted.
        aborted: bool,
    },
    /// Accepted: this job.
    Accepted(String),
}
