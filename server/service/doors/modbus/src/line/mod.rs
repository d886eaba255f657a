//! What the PLC's commands act on: the service, or a script in tests.

mod app_line;

pub use app_line::{AppLine, count_results};

use app::doors::MachineState;
use async_trait::async_trait;

use crate::codes::AckCode;

/// What the status says of the station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Station {
    /// Its state.
    pub state: MachineState,
    /// Whether it is stopped, even if the state does not say so yet.
    pub stopped: bool,
    /// Whether its devices are simulated.
    pub simulated: bool,
}

/// A part to be inspected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TriggeredPart {
    /// Number of the recipe; `None`: by serial number.
    pub recipe: Option<u32>,
    /// Serial number.
    pub serial: String,
    /// Number of the order.
    pub order: Option<String>,
}

/// What a PLC can command. `source` is the address of the PLC.
#[async_trait]
pub trait Line: Send + Sync + 'static {
    /// The state now.
    fn station(&self) -> Station;

    /// Requests the inspection of a part; returns the id of its job.
    async fn trigger(&self, source: &str, part: &TriggeredPart) -> Result<String, AckCode>;

    /// Waits for the end of a job.
    async fn ended(&self, job_id: &str) -> JobEnd;

    /// Cancels a job.
    async fn abort(&self, source: &str, job_id: &str) -> Result<(), AckCode>;

    /// Stops the station.
    async fn stop(&self, source: &str) -> Result<(), AckCode>;

    /// Whether there is such a recipe.
    async fn prepare(&self, recipe: u32) -> Result<(), AckCode>;
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
