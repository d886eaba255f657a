//! Jobs on the wire.

use crate::problem::Problem;
use crate::wire::job::job_inputs::JobInputDto;
use app::error::{AppError, ErrorKind};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use store::{JobState, ResultRef};
use utoipa::ToSchema;

use app::jobs::progress::{Phase, Step};
use app::jobs::{JobInput, JobView};

/// State of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobStateDto {
    /// Waiting in the queue.
    Queued,
    /// Running.
    Running,
    /// Finished with a result.
    Succeeded,
    /// Failed with a problem.
    Failed,
    /// Cancelled by a user.
    Cancelled,
    /// The service ended while the job was running.
    Interrupted,
}

/// Phase of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PhaseDto {
    /// Homing the stage.
    Homing,
    /// Capturing board poses with the laser off.
    ExposingBoard,
    /// Capturing board poses with the laser on.
    ExposingLaser,
    /// Capturing the board on the stage, at several positions.
    ExposingStage,
    /// Collecting the images of a session.
    CollectingImages,
    /// Storing the images as a capture.
    StoringImages,
    /// Unpacking a capture.
    UnpackingCapture,
    /// Detecting corners and lines in calibration images.
    ReadingImages,
    /// Fitting camera, light sheets and stage.
    Calibrating,
    /// Writing the report.
    WritingReport,
    /// The virtual operator places a part on the stage.
    PlacingPart,
    /// Reading the rows of a stopped scan.
    ReadingRows,
    /// Capturing the rows of a scan.
    CapturingRows,
    /// Packing the images of a scan into a capture.
    PackingImages,
    /// Detecting lines in the frames of a scan.
    ReadingFrames,
    /// Reading the lines of an earlier scan.
    ReadingPeaks,
    /// Computing points from lines.
    ComputingCloud,
    /// Storing the points.
    StoringCloud,
    /// Measuring on the points.
    Measuring,
    /// Writing a cloud or mesh to a file.
    Exporting,
}

/// Current step of a job: `message` in machine-readable form. Phases may be added.
#[derive(Debug, Serialize, ToSchema)]
pub struct JobStepDto {
    /// The phase.
    pub phase: PhaseDto,
    /// Number of the current item, from 1; absent if the phase has no items.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
    /// Number of items.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub total: Option<usize>,
}

/// Result of a job.
#[derive(Debug, Serialize, ToSchema)]
pub struct JobResultDto {
    /// Kind of resource.
    #[schema(example = "scan")]
    pub kind: String,
    /// Its id.
    pub id: String,
    /// Its URL.
    pub href: String,
}

/// A job.
#[derive(Debug, Serialize, ToSchema)]
pub struct JobDto {
    /// Its id.
    pub id: String,
    /// `calibration`, `scan`, `recomputation`, `verification`, `export`, `inspection`, `re_evaluation`.
    pub kind: String,
    /// State.
    pub state: JobStateDto,
    /// Progress, 0 to 1.
    pub progress: f64,
    /// Progress message for the operator.
    pub message: String,
    /// Current step; absent unless the job is running.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<JobStepDto>,
    /// Seconds remaining; absent if unknown.
    pub remaining_s: Option<f64>,
    /// The result.
    pub result: Option<JobResultDto>,
    /// Why the job failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<Problem>,
    /// Who requested it.
    pub source: String,
    /// The input; absent if it was stored by a version with codes that this one does not know.
    pub input: Option<JobInputDto>,
    /// Time of acceptance, ms since 1970 (UTC).
    pub created_at_ms: i64,
    /// Time of the start, ms since 1970 (UTC).
    pub started_at_ms: Option<i64>,
    /// Time of the end, ms since 1970 (UTC).
    pub ended_at_ms: Option<i64>,
}

/// URL of a job.
pub fn job_href(id: &str) -> String {
    format!("/api/v1/jobs/{id}")
}

impl From<&ResultRef> for JobResultDto {
    fn from(result: &ResultRef) -> Self {
        let ResultRef { kind, id } = result.clone();
        let href = match id.split_once('/') {
            // Parts of a scan are identified by both ids: `<scan>/<measurement>`.
            Some((scan, part)) => format!("/api/v1/scans/{scan}/{kind}s/{part}"),
            None => format!("/api/v1/{kind}s/{id}"),
        };
        Self { kind, id, href }
    }
}

impl From<Step> for JobStepDto {
    fn from(step: Step) -> Self {
        let (number, of) = step.count.unzip();
        Self { phase: step.phase.into(), number, total: of }
    }
}

impl From<Phase> for PhaseDto {
    fn from(phase: Phase) -> Self {
        match phase {
            Phase::Homing => Self::Homing,
            Phase::ExposingBoard => Self::ExposingBoard,
            Phase::ExposingLaser => Self::ExposingLaser,
            Phase::ExposingStage => Self::ExposingStage,
            Phase::CollectingImages => Self::CollectingImages,
            Phase::StoringImages => Self::StoringImages,
            Phase::UnpackingCapture => Self::UnpackingCapture,
            Phase::ReadingImages => Self::ReadingImages,
            Phase::Calibrating => Self::Calibrating,
            Phase::WritingReport => Self::WritingReport,
            Phase::PlacingPart => Self::PlacingPart,
            Phase::ReadingRows => Self::ReadingRows,
            Phase::CapturingRows => Self::CapturingRows,
            Phase::PackingImages => Self::PackingImages,
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
            result: record.result.as_ref().map(JobResultDto::from),
            state: record.state.into(),
            id: record.id,
            kind: record.kind,
            progress: record.progress,
            message: record.message,
            step: step.map(JobStepDto::from),
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

/// The stored input.
fn stored_input(stored: Value) -> Option<JobInputDto> {
    serde_json::from_value::<JobInput>(stored).ok().and_then(|input| input.try_into().ok())
}

/// The stored reason why a job failed.
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
    fn a_step_has_a_phase_and_counts_only_if_the_phase_has_items() {
        let json_of = |step: Step| serde_json::to_value(JobStepDto::from(step)).unwrap();
        let counted = Phase::ExposingBoard.counted(3, 12);
        assert_eq!(json_of(counted), json!({ "phase": "exposing_board", "number": 3, "total": 12 }));
        assert_eq!(json_of(Phase::Homing.into()), json!({ "phase": "homing" }));
    }
}
