//! One frame's labelled, triangulated points.

use nalgebra::{Vector2, Vector3};
use optics::{Calibration, CameraFrame, DepthRangeMm, PointMm};
use vision::{CentrelinePoint, Centrelines};

use crate::dropped::{DropReason, Dropped};
use crate::label::{Labels, Verdict, along_across, label_frames};

/// A point of a profile, in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePoint {
    /// Diffraction order of its line.
    pub order: i8,
    /// Where the light hit.
    pub hit_in_camera: PointMm<CameraFrame>,
    /// Where it was seen.
    pub seen: CentrelinePoint,
    /// Standard deviation along the camera ray from image noise alone.
    pub noise_sigma_mm: f64,
}

/// What one frame shows of the surface.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Profile {
    /// Points, ordered by order, then along the line.
    pub points: Vec<ProfilePoint>,
    /// Per segment of the centrelines: the order most of its points were given, `None` if they were left out.
    pub labels: Vec<Option<i8>>,
    /// Points and pieces of lines left out.
    pub dropped: Dropped,
}

/// Labels and triangulates one frame by geometry alone: depths within `depth_range_mm`, and the lines in their
/// order across the image. What stays ambiguous is left out and counted as [`DropReason::Doubtful`].
///
/// Within [`crate::envelope::depth_envelope`] every line finds its label; beyond it only where ranks decide.
pub fn label_frame(centrelines: &Centrelines, calibration: &Calibration, depth_range_mm: DepthRangeMm) -> Profile {
    let labels = label_frames(&[centrelines], &[Vector3::zeros()], calibration, depth_range_mm);
    profile_of_frame(centrelines, 0, &labels, calibration, depth_range_mm)
}

/// The profile of frame `frame`, whose centrelines are `lines`, under the labels of the whole scan.
pub(crate) fn profile_of_frame(
    lines: &Centrelines,
    frame: usize,
    labels: &Labels,
    calibration: &Calibration,
    depth_range_mm: DepthRangeMm,
) -> Profile {
    let first = labels.pieces.partition_point(|piece| piece.frame < frame);
    let end = labels.pieces.partition_point(|piece| piece.frame <= frame);
    let mut profile = Profile { labels: vec![None; lines.segments.len()], ..Profile::default() };
    let mut most = vec![0; lines.segments.len()];
    for (piece, verdict) in labels.pieces[first..end].iter().zip(&labels.verdicts[first..end]) {
        let reason = match verdict {
            Verdict::Order(idx) => {
                let order = calibration.orders[*idx];
                if piece.n_points() > most[piece.segment] {
                    most[piece.segment] = piece.n_points();
                    profile.labels[piece.segment] = Some(order);
                }
                profile.triangulate(piece.points(lines), order, calibration, depth_range_mm);
                continue;
            }
            Verdict::Doubtful => DropReason::Doubtful,
            Verdict::Contradicted => DropReason::Contradicted,
        };
        profile.dropped.add_piece(reason, piece.n_points());
    }
    let labelled: usize = labels.pieces[first..end].iter().map(|piece| piece.n_points()).sum();
    let all: usize = lines.segments.iter().map(|segment| segment.points.len()).sum();
    profile.dropped.add_points(DropReason::TooShort, all - labelled);
    let along = |point: &ProfilePoint| along_across(&point.seen, labels.direction).0;
    profile.points.sort_by(|a, b| a.order.cmp(&b.order).then(along(a).total_cmp(&along(b))));
    profile
}

impl Profile {
    fn triangulate(
        &mut self,
        points: &[CentrelinePoint],
        order: i8,
        calibration: &Calibration,
        depth_range_mm: DepthRangeMm,
    ) {
        let mut guess = None;
        for seen in points {
            let pixel = Vector2::new(seen.u_px, seen.v_px);
            let Some(hit) = calibration.triangulate(order, &pixel, guess) else {
                guess = None;
                self.dropped.add_points(DropReason::NoHit, 1);
                continue;
            };
            guess = Some(hit.hit.phi_rad);
            if !depth_range_mm.contains(hit.hit.depth_mm) {
                self.dropped.add_points(DropReason::OutsideDepth, 1);
                continue;
            }
            self.points.push(ProfilePoint {
                order,
                hit_in_camera: hit.hit_in_camera,
                seen: *seen,
                noise_sigma_mm: hit.noise_sigma_mm(&seen.normal, seen.sigma_px),
            });
        }
    }
}
