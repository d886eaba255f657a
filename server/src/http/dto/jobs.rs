//! Jobs on the wire.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use store::{JobState, ResultRef};
use utoipa::ToSchema;

use crate::jobs::JobView;

/// Where a job is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobStateDto {
    /// Waits.
    Queued,
    /// At work.
    Running,
    /// Done, with a result.
    Succeeded,
    /// Ended with a problem.
    Failed,
    /// Ended by a person.
    Cancelled,
    /// The process ended while it ran.
    Interrupted,
}

/// What a job made.
#[derive(Debug, Serialize, ToSchema)]
pub struct ResultDto {
    /// What it is.
    #[schema(example = "scan")]
    pub kind: String,
    /// Its id.
    pub id: String,
    /// Its address.
    pub href: String,
}

/// A job.
#[derive(Debug, Serialize, ToSchema)]
pub struct JobDto {
    /// Its id.
    pub id: String,
    /// `calibration`, `scan`, `recomputation`, `verification`, `export`.
    pub kind: String,
    /// Where it is in its life.
    pub state: JobStateDto,
    /// 0 to 1.
    pub progress: f64,
    /// In the operator's words.
    pub message: String,
    /// Seconds to its end; missing if it cannot be told.
    pub remaining_s: Option<f64>,
    /// What it made.
    pub result: Option<ResultDto>,
    /// Why it failed: a problem.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<Value>,
    /// Who asked.
    pub source: String,
    /// What was asked for.
    pub input: Value,
    /// When it was accepted, wall clock, ms since 1970.
    pub created_at_ms: i64,
    /// When it began.
    pub started_at_ms: Option<i64>,
    /// When it ended.
    pub ended_at_ms: Option<i64>,
}

/// Address of a job.
pub fn job_href(id: &str) -> String {
    format!("/api/v1/jobs/{id}")
}

impl From<&ResultRef> for ResultDto {
    fn from(result: &ResultRef) -> Self {
        let ResultRef { kind, id } = result.clone();
        let href = match id.split_once('/') {
            // What belongs to a scan is named by the scan's id and its own: `<scan>/<measurement>`.
            Some((scan, part)) => format!("/api/v1/scans/{scan}/{kind}s/{part}"),
            None => format!("/api/v1/{kind}s/{id}"),
        };
        Self { kind, id, href }
    }
}

impl From<JobState> for JobStateDto {
    fn from(state: JobState) -> Self {
        match state {
            JobState::Queued => Self::Queued,
            JobState::Running => Self::Running,
            JobState::Succeeded => Self::Succeeded,
            JobState::Failed => Self::Failed,
            JobState::Cancelled => Self::Cancelled,
            JobState::Interrupted => Self::Interrupted,
        }
    }
}

impl From<JobStateDto> for JobState {
    fn from(dto: JobStateDto) -> Self {
        match dto {
            JobStateDto::Queued => Self::Queued,
            JobStateDto::Running => Self::Running,
            JobStateDto::Succeeded => Self::Succeeded,
            JobStateDto::Failed => Self::Failed,
            JobStateDto::Cancelled => Self::Cancelled,
            JobStateDto::Interrupted => Self::Interrupted,
        }
    }
}

impl From<JobView> for JobDto {
    fn from(view: JobView) -> Self {
        let JobView { record, remaining_s } = view;
        Self {
            result: record.result.as_ref().map(ResultDto::from),
            state: record.state.into(),
            id: record.id,
            kind: record.kind,
            progress: record.progress,
            message: record.message,
            remaining_s,
            problem: record.problem,
            source: record.source,
            input: record.input,
            created_at_ms: record.created_at_ms,
            started_at_ms: record.started_at_ms,
            ended_at_ms: record.ended_at_ms,
        }
    }
}
