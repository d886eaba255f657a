//! The profiles of a scan under its labels: some are cached, the others are recomputed whenever needed.

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
    /// Source of the lines.
    pub frames: &'a dyn Frames,
    /// Labels of the lines.
    pub labels: Labels,
    /// Calibration of the station.
    pub calibration: &'a Calibration,
    triangulator: Triangulator,
    /// Depth range of points.
    pub depth_range_mm: DepthRangeMm,
    /// Cached profiles of the first frames.
    kept: Vec<OnceLock<Profile>>,
}

impl<'a> Profiles<'a> {
    /// Nothing is computed yet; the profiles of the first frames, up to `keep_points` points in total, will be cached.
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

    /// The triangulator of its calibration.
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
                    // A concurrent thread has stored the same profile.
                    let _ = kept.set(profile);
                }
                Ok(Cow::Borrowed(kept.get().expect("it was set above")))
            }
        }
    }

    /// The points of a frame that were rejected but could have a label ([`Labels::candidates`]).
    pub fn candidates_of(&self, frame: usize, lines: &Centrelines) -> Profile {
        let labels = self.labels.candidates(frame, lines);
        profile_of_frame(lines, frame, &labels, &self.triangulator, self.depth_range_mm)
    }

    fn computed(&self, frame: usize) -> Result<Profile, ScanError> {
        let lines = lines_of(self.frames, frame)?;
        Ok(profile_of_frame(&lines, frame, &self.labels, &self.triangulator, self.depth_range_mm))
    }
}
