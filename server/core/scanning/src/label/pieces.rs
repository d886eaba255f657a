//! Segments cut at kinks into pieces that belong to one line each, and the samples that represent them.

use multiversion::multiversion;
use vision::{CentrelinePoint, Centrelines, LineDirection, Segment};

use crate::input::line_step::{largest_level_step_px, largest_step_px};
use crate::params::{
    CUT_TRIM_WIDTHS, JOINT_FRAMES, JOINT_GAP_SIGMAS, JOINT_GAP_WIDTHS, JOINT_REACH_WIDTHS, JOINT_SPACING_WIDTHS,
    KINK_SIGMAS, KINK_SLOPE, KINK_SPAN_WIDTHS, MIN_PIECE_POINTS, MIN_SAMPLES, SAMPLE_STRIDE_PX, STEP_LIMIT_SIGMAS,
    STEP_LIMITS,
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
    for (segment_idx, segment) in lines.segments.iter().enumerate() {
        for (first, end) in cut_at_kinks(segment, direction, width_px, lines.correlation_px) {
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

/// Index ranges between jumps, kinks and small steps; the points next to a cut belong to neither side.
fn cut_at_kinks(
    segment: &Segment,
    direction: LineDirection,
    width_px: f64,
    correlation_px: f64,
) -> Vec<(usize, usize)> {
    let span = columns(KINK_SPAN_WIDTHS * width_px);
    // A mean over n correlated points has the variance of one over n / correlation length independent points.
    let correlation = correlation_px.max(1.0).sqrt();
    let place = |point: &CentrelinePoint| (point.along_across(direction).1, 1.0 / (point.sigma_px * correlation));
    let (across, inverse_noise): (Vec<f64>, Vec<f64>) = segment.points.iter().map(place).unzip();
    let bends = bends(&across, span);
    let limits =
        STEP_LIMITS.map(|(span_widths, least_widths)| StepLimit::new(width_px, span_widths, least_widths));
    let steps = steps(&across, &inverse_noise, &limits);
    let trim = cut_trim(width_px);
    let level_step_px = largest_level_step_px(width_px);
    let mut ranges = Vec::new();
    let mut first = 0;
    for idx in possible_cuts(&across, level_step_px, &bends, &steps) {
        let point = &segment.points[idx];
        let moved_px = (across[idx] - across[idx - 1]).abs();
        let jump = || moved_px > largest_step_px(point, width_px, direction);
        // A bend is a second difference: √6 times the noise of one point.
        let bend_sigma = || 6f64.sqrt() * point.sigma_px / span as f64;
        let kink =
            || bends[idx] > KINK_SLOPE && bends[idx] > KINK_SIGMAS * bend_sigma() && is_peak(&bends, idx, span);
        let step = || steps[idx] > 1.0 && is_peak(&steps, idx, span);
        if jump() || kink() || step() {
            ranges.push((first, idx.saturating_sub(trim)));
            first = idx + trim;
        }
    }
    ranges.push((first, across.len()));
    ranges.retain(|(first, end)| first < end);
    ranges
}

/// Points from the second on that may be cuts, which are nearly none: the line moves by more than `level_step_px`, its bend
/// is above [`KINK_SLOPE`], or its step above a limit.
fn possible_cuts(across: &[f64], level_step_px: f64, bends: &[f64], steps: &[f64]) -> Vec<usize> {
    let (mut places, mut n_places) = (vec![0; across.len()], 0);
    let of_pairs = across.iter().zip(across.iter().skip(1).zip(bends.iter().skip(1).zip(&steps[1..]))).enumerate();
    for (before, (from, (to, (bend, step)))) in of_pairs {
        places[n_places] = before + 1;
        let is_above = ((to - from).abs() > level_step_px) | (*bend > KINK_SLOPE) | (*step > 1.0);
        n_places += usize::from(is_above);
    }
    places.truncate(n_places);
    places
}

/// Number of points excluded on either side of a cut. `width_px`: width of lines in focus.
pub fn cut_trim(width_px: f64) -> usize {
    (CUT_TRIM_WIDTHS * width_px).round().max(1.0) as usize
}

/// A length along the line in whole scan columns (rows), at least as many as a slope needs.
fn columns(length_px: f64) -> usize {
    (length_px.round() as usize).max(MIN_PIECE_POINTS - 1)
}

/// Limit for a step between lines fitted to points on either side.
struct StepLimit {
    /// Points on either side.
    span: usize,
    /// Smallest step, in σ of a point.
    sigmas: f64,
    /// Smallest step, px.
    least_px: f64,
}

impl StepLimit {
    fn new(width_px: f64, span_widths: f64, least_widths: f64) -> Self {
        let span = columns(span_widths * width_px);
        let n = span as f64;
        // Variance of a least-squares line of n points half a point beyond its last, in that of a point; twice that of a
        // step.
        let end_variance = 1.0 / n + 3.0 * n / (n * n - 1.0);
        let sigmas = STEP_LIMIT_SIGMAS * (2.0 * end_variance).sqrt();
        Self { span, sigmas, least_px: least_widths * width_px }
    }
}

/// Per point: the change of slope from the `span` points before it to those after it, px/px.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn bends(across: &[f64], span: usize) -> Vec<f64> {
    let mut bends = vec![0.0; across.len()];
    if let (Some(here), Some(ahead)) = (across.get(span..), across.get(2 * span..)) {
        let around = across.iter().zip(here).zip(ahead);
        for (bend, ((behind, here), ahead)) in bends[span..].iter_mut().zip(around) {
            *bend = ((ahead - here) - (here - behind)).abs() / span as f64;
        }
    }
    bends
}

/// Per point: distance between the line fitted to the points before it and the line fitted to those from it on, in
/// limits.
///
/// The lines are computed from running sums; `inverse_noise` holds 1/σ of every point, 1/px.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn steps(across: &[f64], inverse_noise: &[f64], limits: &[StepLimit]) -> Vec<f64> {
    let (mut sum, mut moment) = (0.0, 0.0);
    let (mut sums, mut moments) = (vec![0.0; across.len() + 1], vec![0.0; across.len() + 1]);
    for (place, ((y, sum_to), moment_to)) in across.iter().zip(&mut sums[1..]).zip(&mut moments[1..]).enumerate() {
        sum += y - across[0];
        moment += place as f64 * (y - across[0]);
        (*sum_to, *moment_to) = (sum, moment);
    }
    let mut steps = vec![0.0f64; across.len()];
    for &StepLimit { span, sigmas, least_px } in limits {
        if across.len() < 2 * span {
            continue;
        }
        let n = across.len() + 1 - 2 * span;
        let of = |offset: usize| (&sums[offset..offset + n], &moments[offset..offset + n]);
        let [first, middle, last] = [of(0), of(span), of(2 * span)];
        let (constant, slope) = end_weights(span);
        let (by_noise, by_least) = (1.0 / sigmas, 1.0 / least_px);
        for (i, step) in steps[span..span + n].iter_mut().enumerate() {
            // The line through the points before, half a point beyond the last: Σ (α + β j) y over j = 0 … span − 1.
            let (before, moment) = (middle.0[i] - first.0[i], middle.1[i] - first.1[i]);
            let ends = constant * before + slope * (moment - i as f64 * before);
            // The line through the points after, half a point before the first, counted backwards.
            let (after, moment) = (last.0[i] - middle.0[i], last.1[i] - middle.1[i]);
            let starts = constant * after + slope * ((i + 2 * span - 1) as f64 * after - moment);
            *step = step.max((ends - starts).abs() * (by_noise * inverse_noise[span + i]).min(by_least));
        }
    }
    steps
}

/// Weight of point i of n in the value of their least-squares line half a point beyond the last: α + β i.
fn end_weights(n: usize) -> (f64, f64) {
    let count = n as f64;
    let slope = 6.0 / (count * count - 1.0);
    (1.0 / count - 0.5 * (count - 1.0) * slope, slope)
}

/// Whether `idx` is the strongest bend within a span; the first of equals.
fn is_peak(bends: &[f64], idx: usize, span: usize) -> bool {
    let from = idx.saturating_sub(span);
    let to = (idx + span + 1).min(bends.len());
    bends[from..idx].iter().all(|other| *other < bends[idx])
        && bends[idx..to].iter().all(|other| *other <= bends[idx])
}
