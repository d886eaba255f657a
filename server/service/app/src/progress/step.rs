//! What a job does at this moment, by names that programs and other languages can hold on to.

/// What a job does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
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

/// Where a job is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// What it does.
    pub phase: Phase,
    /// The how-manieth of how many, where it counts.
    pub count: Option<(usize, usize)>,
}

impl Phase {
    /// The `number`th of `of`.
    pub fn counted(self, number: usize, of: usize) -> Step {
        Step { phase: self, count: Some((number, of)) }
    }
}

impl From<Phase> for Step {
    fn from(phase: Phase) -> Self {
        Self { phase, count: None }
    }
}
