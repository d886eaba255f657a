//! Segments cut at kinks into pieces that belong to one line each, and the samples that represent them.

use vision::{CentrelinePoint, Centrelines};

use super::kinks::Kinks;
use crate::params::{
    JOINT_FRAMES, JOINT_GAP_SIGMAS, JOINT_GAP_WIDTHS, JOINT_REACH_WIDTHS, JOINT_SPACING_WIDTHS, MIN_PIECE_POINTS,
    MIN_SAMPLES, SAMPLE_STRIDE_PX,
};

/// A piece of a segment: the unit that has one label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// Frame of the piece.
    pub frame: usize,
    /// Segment within the frame.
    pub segment: usize,
    /// First point within the segment.
    pub first: usize,
    /// One past the last point.
    pub end: usize,
    /// Scan column (row) of the first point; the others are consecutive.
    pub along: i64,
    /// Scan columns (rows) between samples.
    pub stride: usize,
    /// Whether it continues the previous piece without any sign of a joint.
    pub continues: bool,
}

impl Piece {
    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.end - self.first
    }

    /// One past the scan column (row) of the last point.
    pub fn end_along(&self) -> i64 {
        self.along + self.n_points() as i64
    }

    /// The part of its segment in scan columns (rows) from `from` to before `to`.
    pub fn part(&self, from: i64, to: i64) -> Self {
        let n_points = (to - from) as usize;
        let first = (self.first as i64 + from - self.along) as usize;
        Self { first, end: first + n_points, along: from, stride: stride_for(n_points), ..*self }
    }

    /// The points of the piece.
    pub fn points<'a>(&self, lines: &'a Centrelines) -> &'a [CentrelinePoint] {
        &lines.segments[self.segment].points[self.first..self.end]
    }

    /// The point in scan column (row) `along`, if the piece has one.
    pub fn point_at<'a>(&self, lines: &'a Centrelines, along: i64) -> Option<&'a CentrelinePoint> {
        let idx = usize::try_from(along - self.along).ok()?;
        self.points(lines).get(idx)
    }

    /// Scan columns (rows) of the samples: multiples of the stride, so that all frames are sampled alike.
    pub fn samples(&self) -> impl Iterator<Item = i64> + use<> {
        let stride = self.stride as i64;
        let start = (self.along + stride - 1).div_euclid(stride) * stride;
        (start..self.along + self.n_points() as i64).step_by(self.stride)
    }
}

/// The pieces of one frame, ordered by segment, then along the line. `width_px`: full width of its lines in focus.
pub fn pieces_of_frame(lines: &Centrelines, frame: usize, width_px: f64) -> Vec<Piece> {
    let (mut pieces, direction) = (Vec::new(), lines.direction);
    let mut kinks = Kinks::new(direction, width_px, lines.correlation_px);
    for (segment_idx, segment) in lines.segments.iter().enumerate() {
        for (first, end) in kinks.ranges_between(segment) {
            if end - first < MIN_PIECE_POINTS {
                continue;
            }
            let along = segment.points[first].along_across(direction).0.round() as i64;
            let stride = stride_for(end - first);
            pieces.push(Piece { frame, segment: segment_idx, first, end, along, stride, continues: false });
        }
    }
    pieces
}

/// The ends of a frame's pieces that may be joints of lines. `width_px`: full width of its lines in focus.
pub fn joints_of_frame(pieces: &[Piece], lines: &Centrelines, width_px: f64) -> Vec<Joint> {
    let mut joints = Vec::with_capacity(2 * pieces.len());
    for piece in pieces {
        let points = piece.points(lines);
        let (start, end) = (piece.along, piece.along + points.len() as i64);
        let joint = |along: i64, point: &CentrelinePoint, starts: bool| Joint {
            along,
            across_px: point.along_across(lines.direction).1,
            sigma_px: point.sigma_px,
            starts,
            segment: piece.segment,
        };
        joints.push(joint(start, &points[0], true));
        joints.push(joint(end, &points[points.len() - 1], false));
    }
    remove_ends_at_small_gaps(&mut joints, width_px, lines.correlation_px);
    joints
}

/// Per frame: the joints in the frames before and after. `travel_order`: the frames in the sequence of their stage
/// positions.
pub fn joints_nearby(joints: &[Vec<Joint>], travel_order: &[usize]) -> Vec<Vec<Joint>> {
    let mut nearby: Vec<Vec<Joint>> = vec![Vec::new(); joints.len()];
    for (place, &frame) in travel_order.iter().enumerate() {
        let around = place.saturating_sub(JOINT_FRAMES)..(place + JOINT_FRAMES + 1).min(travel_order.len());
        nearby[frame] =
            around.filter(|&other| other != place).flat_map(|other| joints[travel_order[other]].clone()).collect();
        nearby[frame].sort_by_key(|joint| joint.along);
    }
    nearby
}

/// Cuts the pieces of a frame where the same line ends or is cut in one of the frames before and after: a joint hidden
/// in one frame is visible in its neighbours. `width_px`: full width of its lines in focus.
pub fn cut_at_joints(pieces: &[Piece], lines: &Centrelines, width_px: f64, nearby: &[Joint]) -> Vec<Piece> {
    if nearby.is_empty() {
        return pieces.to_vec();
    }
    pieces.iter().flat_map(|piece| cut_piece(*piece, lines, width_px, nearby)).collect()
}

/// An end of a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Scan column (row).
    along: i64,
    across_px: f64,
    sigma_px: f64,
    /// Whether the piece starts here.
    starts: bool,
    /// Segment of the piece.
    segment: usize,
}

/// Removes ends that face each other across one or two missing points or a dark speckle: such a gap is not a
/// joint. Ends within one segment are kept, since no points are missing there.
fn remove_ends_at_small_gaps(joints: &mut Vec<Joint>, width_px: f64, correlation_px: f64) {
    joints.sort_by(|a, b| a.along.cmp(&b.along).then(a.across_px.total_cmp(&b.across_px)));
    let gap = (correlation_px.ceil() as i64).max(2);
    let faces = |idx: usize| {
        let joint = joints[idx];
        let from = joints.partition_point(|other| other.along < joint.along - gap);
        joints[from..].iter().take_while(|other| other.along <= joint.along + gap).any(|other| {
            let apart = if other.starts { other.along - joint.along } else { joint.along - other.along };
            let noise_px = JOINT_GAP_SIGMAS * joint.sigma_px.hypot(other.sigma_px);
            let gap_px = JOINT_GAP_WIDTHS * width_px;
            other.starts != joint.starts
                && other.segment != joint.segment
                && apart > 0
                && (joint.across_px - other.across_px).abs() < gap_px.max(noise_px)
        })
    };
    let kept: Vec<Joint> = (0..joints.len()).filter(|&idx| !faces(idx)).map(|idx| joints[idx]).collect();
    *joints = kept;
}

fn cut_piece(piece: Piece, lines: &Centrelines, width_px: f64, joints: &[Joint]) -> Vec<Piece> {
    let spacing = (JOINT_SPACING_WIDTHS * width_px).round().max(MIN_PIECE_POINTS as f64) as i64;
    let end = piece.along + piece.n_points() as i64;
    let mut places = vec![piece.along];
    for Joint { along, across_px, .. } in &joints[joints.partition_point(|joint| joint.along <= piece.along)..] {
        if *along >= end {
            break;
        }
        let near = piece.point_at(lines, *along).is_some_and(|point| {
            (point.along_across(lines.direction).1 - across_px).abs() < JOINT_REACH_WIDTHS * width_px
        });
        if near && places[places.len() - 1] + spacing <= *along && along + spacing <= end {
            places.push(*along);
        }
    }
    places.push(end);
    let parts = places.windows(2).map(|pair| piece.part(pair[0], pair[1]));
    parts.filter(|part| part.n_points() >= MIN_PIECE_POINTS).collect()
}

/// The largest of 16, 8, 4, … that still gives enough samples: strides are nested, so that pieces of neighbouring
/// frames share their samples.
pub fn stride_for(n_points: usize) -> usize {
    let mut stride = SAMPLE_STRIDE_PX;
    while stride > 1 && n_points < stride * MIN_SAMPLES {
        stride /= 2;
    }
    stride
}
