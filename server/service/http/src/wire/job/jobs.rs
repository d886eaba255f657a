//! Jobs on the wire.

use crate::problem::Problem;
use crate::wire::job::job_inputs::JobInputDto;
use app::error::{AppError, ErrorKind};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use store::{JobState, ResultRef};
use utoipa::ToSchema;

use app::jobs::{JobInput, JobView};
use app::progress::{Phase, Step};

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

/// What a job does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PhaseDto {
    /// The stage looks for its origin.
    Homing,
    /// Poses of the board, by daylight.
    ExposingBoard,
    /// Poses of the board, by laser light.
    ExposingLaser,
    /// The board on the stage, at several positions.
    ExposingStage,
    /// Pictures of a session are put together.
    GatheringPictures,
    /// Pictures become a capture.
    StoringPictures,
    /// A capture becomes pictures.
    UnpackingCapture,
    /// Corners and lines are looked for in the pictures of a calibration.
    ReadingPictures,
    /// Camera, light and stage are fitted.
    Calibrating,
    /// What was found is written down.
    WritingReport,
    /// The virtual operator puts a part on the stage.
    PlacingPart,
    /// Rows of a scan that was stopped are read back.
    ReadingRows,
    /// Rows of a scan.
    TakingRows,
    /// Pictures of a scan become a capture.
    PackingPictures,
    /// Lines are looked for in the pictures of a scan.
    ReadingFrames,
    /// Lines of an earlier scan are read back.
    ReadingPeaks,
    /// Lines become points.
    ComputingCloud,
    /// Points are stored.
    StoringCloud,
    /// A value is fitted to the points.
    Measuring,
    /// A cloud or mesh is written as a file.
    Exporting,
}

/// What a job does at this moment: `message` for programs and other languages. More phases may come.
#[derive(Debug, Serialize, ToSchema)]
pub struct StepDto {
    /// What it does.
    pub phase: PhaseDto,
    /// At which one of them it is, from 1; missing where nothing is counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
    /// How many they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of: Option<usize>,
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
    /// What it does at this moment, by name; missing unless it is at work.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<StepDto>,
    /// Seconds to its end; missing if unknown.
    pub remaining_s: Option<f64>,
    /// What it made.
    pub result: Option<ResultDto>,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<Problem>,
    /// Who asked.
    pub source: String,
    /// What was asked for; missing if another version stored it in words that this one does not know.
    pub input: Option<JobInputDto>,
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

impl From<Step> for StepDto {
    fn from(step: Step) -> Self {
        let (number, of) = step.count.unzip();
        Self { phase: step.phase.into(), number, of }
    }
}

impl From<Phase> for PhaseDto {
    fn from(phase: Phase) -> Self {
        match phase {
            Phase::Homing => Self::Homing,
            Phase::ExposingBoard => Self::ExposingBoard,
            Phase::ExposingLaser => Self::ExposingLaser,
            Phase::ExposingStage => Self::ExposingStage,
            Phase::GatheringPictures => Self::GatheringPictures,
            Phase::StoringPictures => Self::StoringPictures,
            Phase::UnpackingCapture => Self::UnpackingCapture,
            Phase::ReadingPictures => Self::ReadingPictures,
            Phase::Calibrating => Self::Calibrating,
            Phase::WritingReport => Self::WritingReport,
            Phase::PlacingPart => Self::PlacingPart,
            Phase::ReadingRows => Self::ReadingRows,
            Phase::TakingRows => Self::TakingRows,
            Phase::PackingPictures => Self::PackingPictures,
            Phase::ReadingFrames => Self::ReadingFrames,
            Phase::ReadingPeaks => Self::ReadingPeaks,
            Phase::ComputingCloud => Self::ComputingCloud,
            Phase::StoringCloud => Self::StoringCloud,
            Phase::Measuring => Self::Measuring,
            Phase::Exporting => Self::Exporting,
        }
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
        let JobView { record, step, remaining_s } = view;
        Self {
            result: record.result.as_ref().map(ResultDto::from),
            state: record.state.into(),
            id: record.id,
            kind: record.kind,
            progress: record.progress,
            message: record.message,
            step: step.map(StepDto::from),
            remaining_s,
            problem: record.problem.map(stored_problem),
            source: record.source,
            input: stored_input(record.input),
            created_at_ms: record.created_at_ms,
            started_at_ms: record.started_at_ms,
            ended_at_ms: record.ended_at_ms,
        }
    }
}

/// What was asked for, as it was stored.
fn stored_input(stored: Value) -> Option<JobInputDto> {
    serde_json::from_value::<JobInput>(stored).ok().and_then(|input| input.try_into().ok())
}

/// Why a job failed, as it was stored.
fn stored_problem(stored: Value) -> Problem {
    let error: AppError = serde_json::from_value(stored).unwrap_or_else(|cause| {
        AppError::new(ErrorKind::Damaged, "why the job failed was stored by another version")
            .because(cause.to_string())
    });
    Problem::from(error)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_step_is_a_name_and_counts_only_where_something_is_counted() {
        let told = |step: Step| serde_json::to_value(StepDto::from(step)).unwrap();
        let counted = Phase::ExposingBoard.counted(3, 12);
        assert_eq!(told(counted), json!({ "phase": "exposing_board", "number": 3, "of": 12 }));
        assert_eq!(told(Phase::Homing.into()), json!({ "phase": "homing" }));
    }
}
