//! Jobs by what they need: the station, or only records and artifacts.

use serde::{Deserialize, Serialize};

use crate::jobs::{
    CalibrateInput, ComputeContext, Done, ExportInput, InspectInput, JobEnd, JobInput, ReEvaluateInput,
    RecomputeInput, ScanInput, ScanSource, Source, StationContext, VerifyInput, calibrate, export, inspect, scan,
    verify,
};

/// A station job or a computation.
#[derive(Debug, Clone, PartialEq)]
pub enum Job {
    /// Needs the station.
    Station(StationJob),
    /// Computes only.
    Compute(ComputeJob),
}

/// Moves the stage, exposes, turns the laser on. Runs in the process that owns the station, one at a time; Stop ends it.
#[derive(Debug, Clone, PartialEq)]
pub enum StationJob {
    /// The virtual operator of the simulated station moves the board.
    Calibration(CalibrateInput),
    /// Stop-and-go or continuous.
    Scan(ScanInput),
    /// A scan of a reference part.
    Verification(VerifyInput),
    /// A scan, judged by a recipe.
    Inspection(InspectInput),
}

/// A function of records and artifacts. It can be serialised for another process, and so can its outcome:
/// `Result<`[`Done`]`, `[`JobEnd`]`>`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ComputeJob {
    /// Calibrate from a session.
    SessionCalibration {
        /// Its id.
        session_id: String,
        /// The input.
        input: CalibrateInput,
    },
    /// Calibrate from a capture.
    CaptureCalibration {
        /// Its id.
        capture_id: String,
        /// The input.
        input: CalibrateInput,
    },
    /// Scan the frames of a capture.
    CaptureScan {
        /// Its id.
        frames: RecordedFrames,
        /// The input.
        input: ScanInput,
    },
    /// Compare the frames of a capture with the reference part they show.
    CaptureVerification {
        /// Its id.
        frames: RecordedFrames,
        /// The input.
        input: VerifyInput,
    },
    /// Judge the frames of a capture by a recipe.
    CaptureInspection {
        /// Its id.
        frames: RecordedFrames,
        /// The input.
        input: InspectInput,
    },
    /// See [`RecomputeInput`].
    Recomputation(RecomputeInput),
    /// See [`ExportInput`].
    Export(ExportInput),
    /// See [`ReEvaluateInput`].
    ReEvaluation(ReEvaluateInput),
}

/// The frames of one scan of a capture.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordedFrames {
    /// The capture.
    pub capture_id: String,
    /// Its scan of this name; `None`: the only one.
    pub scan: Option<String>,
}

impl From<JobInput> for Job {
    fn from(input: JobInput) -> Self {
        match input {
            JobInput::Calibration(input) => match (input.session_id.clone(), input.source.clone()) {
                (Some(session_id), _) => Self::Compute(ComputeJob::SessionCalibration { session_id, input }),
                (None, Source::Capture { capture_id }) => {
                    Self::Compute(ComputeJob::CaptureCalibration { capture_id, input })
                }
                (None, Source::Station) => Self::Station(StationJob::Calibration(input)),
            },
            JobInput::Scan(input) => match recorded(&input.source) {
                Some(frames) => Self::Compute(ComputeJob::CaptureScan { frames, input }),
                None => Self::Station(StationJob::Scan(input)),
            },
            JobInput::Verification(input) => match recorded(&input.scan.source) {
                Some(frames) => Self::Compute(ComputeJob::CaptureVerification { frames, input }),
                None => Self::Station(StationJob::Verification(input)),
            },
            JobInput::Recomputation(input) => Self::Compute(ComputeJob::Recomputation(input)),
            JobInput::Export(input) => Self::Compute(ComputeJob::Export(input)),
            JobInput::Inspection(input) => match recorded(&input.source) {
                Some(frames) => Self::Compute(ComputeJob::CaptureInspection { frames, input }),
                None => Self::Station(StationJob::Inspection(input)),
            },
            JobInput::ReEvaluation(input) => Self::Compute(ComputeJob::ReEvaluation(input)),
        }
    }
}

fn recorded(source: &ScanSource) -> Option<RecordedFrames> {
    match source {
        ScanSource::Station => None,
        ScanSource::Capture { capture_id, scan } => {
            Some(RecordedFrames { capture_id: capture_id.clone(), scan: scan.clone() })
        }
    }
}

impl StationJob {
    /// Runs it on the calling thread.
    pub fn run(self, ctx: &StationContext) -> Result<Done, JobEnd> {
        match self {
            Self::Calibration(input) => calibrate::at_station(&input, ctx),
            Self::Scan(input) => scan::at_station(&input, ctx),
            Self::Verification(input) => verify::at_station(&input, ctx),
            Self::Inspection(input) => inspect::at_station(&input, ctx),
        }
    }
}

impl ComputeJob {
    /// Runs it on the calling thread.
    pub fn run(self, ctx: &ComputeContext) -> Result<Done, JobEnd> {
        match self {
            Self::SessionCalibration { session_id, input } => calibrate::from_session(&input, &session_id, ctx),
            Self::CaptureCalibration { capture_id, input } => calibrate::from_capture(&input, &capture_id, ctx),
            Self::CaptureScan { frames, input } => scan::of_capture(&input, &frames, ctx),
            Self::CaptureVerification { frames, input } => verify::of_capture(&input, &frames, ctx),
            Self::CaptureInspection { frames, input } => inspect::of_capture(&input, &frames, ctx),
            Self::Recomputation(input) => scan::recompute::run(input, ctx),
            Self::Export(input) => export::run(input, ctx),
            Self::ReEvaluation(input) => inspect::re_evaluate(&input, ctx),
        }
    }
}
