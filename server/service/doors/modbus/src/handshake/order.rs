//! Commands to be carried out, and their outcome.

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
    Trigger {
        /// Number of the recipe; `None`: by serial number.
        recipe: Option<u32>,
        /// Serial number.
        serial: String,
    },
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

/// How a triggered inspection ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum JobEnd {
    /// With a result, which is delivered.
    Finished,
    /// Without one, because of an error.
    Failed,
    /// Without one: aborted, or the station was stopped.
    Cancelled,
}

impl JobEnd {
    /// Its number in the error register.
    pub fn number(self) -> u16 {
        match self {
            Self::Finished => 0,
            Self::Failed => 1,
            Self::Cancelled => 2,
        }
    }
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
