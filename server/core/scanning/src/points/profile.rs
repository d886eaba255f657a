//! One frame's labelled, triangulated points.

use optics::{CameraFrame, DepthRangeMm, Hits, PointMm, RayHit, Triangulator};
use vision::{CentrelinePoint, Centrelines};

use crate::input::frames::OneFrame;
use crate::input::motions::FrameMotion;
use crate::label::{LabelOutcome, Labels, Piece, label_frames};
use crate::points::dropped::{DropReason, Dropped};

/// A point of a profile, in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePoint {
    /// Diffraction order of its line.
    pub order: i8,
    /// The lit point of the surface.
    pub hit_in_camera: PointMm<CameraFrame>,
    /// The centreline point in the image.
    pub centreline: CentrelinePoint,
    /// Standard deviation along the camera ray from image noise alone.
    pub noise_sigma_mm: f64,
}

/// The surface points of one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Profile {
    /// Points, ordered by order, then along the line.
    pub points: Vec<ProfilePoint>,
    /// Per segment of the centrelines: the order of its longest labelled piece, `None` without one.
    pub labels: Vec<Option<i8>>,
    /// Dropped points and pieces of lines.
    pub dropped: Dropped,
}

/// Labels and triangulates one frame by geometry alone: depths within `depth_range_mm`, and the order of the lines
/// across the image. Ambiguous lines are dropped and counted as [`DropReason::Doubtful`].
///
/// Within [`crate::points::envelope::depth_envelope`] every line gets its label; beyond it only where ranks decide. For
/// many frames, [`Profile::fill`] reuses the memory of a profile.
pub fn label_frame(
    centrelines: &Centrelines,
    triangulator: &Triangulator,
    depth_range_mm: DepthRangeMm,
) -> Profile {
    let mut profile = Profile::default();
    profile.fill(centrelines, triangulator, depth_range_mm);
    profile
}

/// The profile of frame `frame`, whose centrelines are `lines`, under the labels of the whole scan.
pub(crate) fn profile_of_frame(
    lines: &Centrelines,
    frame: usize,
    labels: &Labels,
    triangulator: &Triangulator,
    depth_range_mm: DepthRangeMm,
) -> Profile {
    let mut profile = Profile::default();
    profile.fill_from(lines, frame, labels, triangulator, depth_range_mm);
    profile
}

/// The points of one piece of a line, and the hits of their rays.
#[derive(Debug, Default)]
struct PieceHits {
    u_px: Vec<f64>,
    v_px: Vec<f64>,
    hits: Hits,
}

impl PieceHits {
    fn triangulate(&mut self, points: &[CentrelinePoint], order_idx: usize, triangulator: &Triangulator) {
        self.u_px.clear();
        self.v_px.clear();
        self.u_px.extend(points.iter().map(|centreline| centreline.u_px));
        self.v_px.extend(points.iter().map(|centreline| centreline.v_px));
        triangulator.triangulate_all(order_idx, &self.u_px, &self.v_px, &mut self.hits);
    }
}

impl Profile {
    /// Replaces the content by what [`label_frame`] returns, reusing the memory.
    pub fn fill(&mut self, centrelines: &Centrelines, triangulator: &Triangulator, depth_range_mm: DepthRangeMm) {
        let labels = label_frames(&OneFrame(centrelines), &[FrameMotion::at_rest()], triangulator, depth_range_mm);
        match labels {
            Ok(labels) => self.fill_from(centrelines, 0, &labels, triangulator, depth_range_mm),
            // The frame shows a line alone that the calibration does not have.
            Err(_) => *self = Self { labels: vec![None; centrelines.segments.len()], ..Self::default() },
        }
    }

    fn fill_from(
        &mut self,
        lines: &Centrelines,
        frame: usize,
        labels: &Labels,
        triangulator: &Triangulator,
        depth_range_mm: DepthRangeMm,
    ) {
        let orders = &triangulator.calibration().orders;
        let mut piece_hits = PieceHits::default();
        let first = labels.pieces.partition_point(|piece| piece.frame < frame);
        let end = labels.pieces.partition_point(|piece| piece.frame <= frame);
        self.points.clear();
        self.labels.clear();
        self.labels.resize(lines.segments.len(), None);
        self.dropped = Dropped::default();
        let mut most = vec![0; lines.segments.len()];
        let mut kept: Vec<(&Piece, usize)> = Vec::new();
        for (piece, outcome) in labels.pieces[first..end].iter().zip(&labels.outcomes[first..end]) {
            match outcome {
                LabelOutcome::Order(idx) => kept.push((piece, *idx)),
                LabelOutcome::Doubtful => self.dropped.add_piece(DropReason::Doubtful, piece.n_points()),
                LabelOutcome::Contradicted => self.dropped.add_piece(DropReason::Contradicted, piece.n_points()),
            }
        }
        for &(piece, idx) in &kept {
            if piece.n_points() > most[piece.segment] {
                most[piece.segment] = piece.n_points();
                self.labels[piece.segment] = Some(orders[idx]);
            }
        }
        kept.sort_by_key(|(piece, idx)| (orders[*idx], piece.along));
        let overlap = |pair: &[(&Piece, usize)]| pair[0].1 == pair[1].1 && pair[0].0.end_along() > pair[1].0.along;
        let is_sorted = !kept.windows(2).any(overlap);
        self.points.reserve(kept.iter().map(|(piece, _)| piece.n_points()).sum());
        for (piece, idx) in kept {
            piece_hits.triangulate(piece.points(lines), idx, triangulator);
            self.add(piece.points(lines), orders[idx], &piece_hits.hits, depth_range_mm);
        }
        let labelled: usize = labels.pieces[first..end].iter().map(|piece| piece.n_points()).sum();
        let all: usize = lines.segments.iter().map(|segment| segment.points.len()).sum();
        self.dropped.add_points(DropReason::TooShort, all - labelled);
        if !is_sorted {
            let along = |point: &ProfilePoint| labels.along_across(point.order, &point.centreline).0;
            self.points.sort_by(|a, b| a.order.cmp(&b.order).then(along(a).total_cmp(&along(b))));
        }
    }

    /// Adds the points within the depth range; counts the others.
    fn add(&mut self, points: &[CentrelinePoint], order: i8, hits: &Hits, depth_range_mm: DepthRangeMm) {
        let mut first = 0;
        let is_inside = |depth_mm: &f64| depth_range_mm.contains(*depth_mm);
        for run in hits.z_mm.chunk_by(|a, b| is_inside(a) == is_inside(b)) {
            let range = first..first + run.len();
            first = range.end;
            if is_inside(&run[0]) {
                let point = |(centreline, hit): (&CentrelinePoint, RayHit)| ProfilePoint {
                    order,
                    hit_in_camera: hit.in_camera,
                    centreline: *centreline,
                    noise_sigma_mm: hit.noise_sigma_mm(&centreline.normal, centreline.sigma_px),
                };
                self.points.extend(points[range.clone()].iter().zip(hits.in_range(range)).map(point));
            } else {
                let n_missed = run.iter().filter(|depth_mm| depth_mm.is_nan()).count();
                self.dropped.add_points(DropReason::NoHit, n_missed);
                self.dropped.add_points(DropReason::OutsideDepth, run.len() - n_missed);
            }
        }
    }
}
