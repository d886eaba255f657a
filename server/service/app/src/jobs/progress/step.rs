//! The current step of a job, by stable names for programs and translations.

/// Phase of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
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

/// The step of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// The phase.
    pub phase: Phase,
    /// Number of the item and number of items, if counted.
    pub count: Option<(usize, usize)>,
}

impl Phase {
    /// Item `number` of `of`.
    pub fn counted(self, number: usize, of: usize) -> Step {
        Step { phase: self, count: Some((number, of)) }
    }
}

impl From<Phase> for Step {
    fn from(phase: Phase) -> Self {
        Self { phase, count: None }
    }
}
