//! The profiles of a scan under its labels: some are kept, the others computed again whenever they are needed.

use std::borrow::Cow;
use std::sync::OnceLock;

use optics::{Calibration, DepthRangeMm, Triangulator};
use vision::Centrelines;

use crate::error::ScanError;
use crate::input::frames::{Frames, lines_of};
use crate::label::Labels;
use crate::points::profile::{Profile, profile_of_frame};

/// The profiles of all frames.
pub struct Profiles<'a> {
    /// Where the lines are.
    pub frames: &'a dyn Frames,
    /// Their orders.
    pub labels: Labels,
    /// The station.
    pub calibration: &'a Calibration,
    triangulator: Triangulator,
    /// Depths points may have.
    pub depth_range_mm: DepthRangeMm,
    /// Of the first frames.
    kept: Vec<OnceLock<Profile>>,
}

impl<'a> Profiles<'a> {
    /// Nothing is computed yet; the profiles of the first frames, with `keep_points` points together, will be kept.
    pub fn new(
        frames: &'a dyn Frames,
        labels: Labels,
        (calibration, triangulator): (&'a Calibration, Triangulator),
        depth_range_mm: DepthRangeMm,
        keep_points: usize,
    ) -> Self {
        let mut n_points = 0;
        let beyond = labels.pieces.iter().find(|piece| {
            n_points += piece.n_points();
            n_points > keep_points
        });
        let n_kept = beyond.map_or(frames.n_frames(), |piece| piece.frame);
        let kept = (0..n_kept).map(|_| OnceLock::new()).collect();
        Self { frames, labels, calibration, triangulator, depth_range_mm, kept }
    }

    /// Its tables.
    pub fn triangulator(&self) -> &Triangulator {
        &self.triangulator
    }

    /// The profile of a frame.
    pub fn of(&self, frame: usize) -> Result<Cow<'_, Profile>, ScanError> {
        match self.kept.get(frame) {
            None => Ok(Cow::Owned(self.computed(frame)?)),
            Some(kept) => {
                if kept.get().is_none() {
                    let mut profile = self.computed(frame)?;
                    profile.points.shrink_to_fit();
                    // Whoever comes second finds the same.
                    let _ = kept.set(profile);
                }
                Ok(Cow::Borrowed(kept.get().expect("it was set just now")))
            }
        }
    }

    /// The points a frame leaves out that could have a label all the same ([`Labels::candidates`]).
    pub fn candidates_of(&self, frame: usize, lines: &Centrelines) -> Profile {
        let labels = self.labels.candidates(frame, lines);
        profile_of_frame(lines, frame, &labels, &self.triangulator, self.depth_range_mm)
    }

    fn computed(&self, frame: usize) -> Result<Profile, ScanError> {
        let lines = lines_of(self.frames, frame)?;
        Ok(profile_of_frame(&lines, frame, &self.labels, &self.triangulator, self.depth_range_mm))
    }
}
