//! The same line in the next frame, and the same line beyond a gap.

use std::collections::BTreeMap;

use vision::{CentrelinePoint, Centrelines, LineDirection};

use super::evidence::Evidence;
use super::hypotheses::{Sample, Samples};
use crate::error::ScanError;
use crate::input::frames::{Frames, in_order, lines_of};
use crate::input::line_step::largest_step_px;
use crate::label::columns::{Columns, pieces_of};
use crate::label::kinks::cut_trim;
use crate::label::pieces::Piece;
use crate::params::{
    CONTINUATION_GAP_PITCHES, CONTINUATION_GATE_PITCHES, CONTINUATION_POINTS, CONTINUATION_WEIGHT, JOINT_WEIGHT,
    SECTION_WEIGHT, TRACK_GATE_PITCHES, TRACK_WEIGHT,
};

/// Per sample: the sample of the same line in the neighbouring frames along the travel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Partners {
    /// In the frame at the next stage position.
    pub next: Vec<Option<usize>>,
    /// In the frame at the stage position before.
    pub previous: Vec<Option<usize>>,
}

/// Tracks every sample into the frames before and after along the stage (`travel_order`): the mutually nearest
/// line in its column (row), within the gate. Adds a bond to that line, which is stronger the closer the lines are
/// in the image.
pub fn add_tracks(
    evidence: &mut Evidence,
    samples: &Samples,
    pieces: &[Piece],
    frames: &dyn Frames,
    direction: LineDirection,
    travel_order: &[usize],
) -> Result<Partners, ScanError> {
    let mut partners = Partners { next: vec![None; samples.all.len()], previous: vec![None; samples.all.len()] };
    let of_pair = |place: usize| -> Result<FollowedLines, ScanError> {
        let [here, there] = [travel_order[place], travel_order[place + 1]];
        let (behind, ahead) = (lines_of(frames, here)?, lines_of(frames, there)?);
        let columns =
            [(here, &behind), (there, &ahead)].map(|(frame, lines)| Columns::new(pieces, frame, lines, direction));
        Ok(FollowedLines::new(samples, &columns[0], &columns[1]))
    };
    in_order(travel_order.len().saturating_sub(1), of_pair, |followed| {
        followed.next.into_iter().for_each(|(idx, partner)| partners.next[idx] = partner);
        followed.previous.into_iter().for_each(|(idx, partner)| partners.previous[idx] = partner);
        followed.bonds.into_iter().for_each(|((a, b), weight)| evidence.add_bond(a, b, weight));
        Ok(())
    })?;
    Ok(partners)
}

/// The lines that were followed between two frames that are neighbours along the travel.
#[derive(Default)]
struct FollowedLines {
    /// Samples of the first frame with their partners in the second.
    next: Vec<(usize, Option<usize>)>,
    /// Samples of the second frame with their partners in the first.
    previous: Vec<(usize, Option<usize>)>,
    /// Weights of the bonds between their pieces.
    bonds: BTreeMap<(usize, usize), f64>,
}

impl FollowedLines {
    fn new(samples: &Samples, first: &Columns, second: &Columns) -> Self {
        let mut followed_lines = Self::default();
        let Self { next, previous, bonds } = &mut followed_lines;
        for (here, there, partners) in [(first, second, next), (second, first, previous)] {
            let pieces = here.pieces;
            for piece in here.own.clone() {
                for idx in samples.range(piece) {
                    let Some((other, closeness)) = followed(&samples.all[idx], here, there) else { continue };
                    partners.push((idx, samples.at(other, &pieces[other], samples.all[idx].along)));
                    // Each side of the bond contributes half.
                    let weight = 0.5 * TRACK_WEIGHT * closeness * crate::label::sample_weight(&pieces[piece]);
                    *bonds.entry((piece.min(other), piece.max(other))).or_default() += weight;
                }
            }
        }
        followed_lines
    }
}

/// The piece that continues the line of `sample` in frame `there`, and its closeness (1 … 0 at the gate).
fn followed(sample: &Sample, here: &Columns, there: &Columns) -> Option<(usize, f64)> {
    let gate = TRACK_GATE_PITCHES * sample.pitch_px;
    let other = there.nearest(sample.along, sample.across_px, gate)?;
    let back = here.nearest(sample.along, other.across_px, gate)?;
    let miss = (other.across_px - sample.across_px) / gate;
    (back.piece == sample.piece).then_some((other.piece, 1.0 - miss * miss))
}

/// Adds bonds between pieces of one frame that continue one another across a gap.
pub fn add_continuations(evidence: &mut Evidence, samples: &Samples, pieces: &[Piece], ends: &[(End, End)]) {
    for of_frame in pieces.chunk_by(|a, b| a.frame == b.frame) {
        let own = pieces_of(pieces, of_frame[0].frame);
        let lines = FrameEnds::new(own.clone(), samples, ends);
        for left in own {
            // A line is continued only by its next piece, however many follow: support for a label must not grow with
            // the number of pieces into which a line was cut.
            let Some((right, best)) = lines.next(left) else { continue };
            if lines.previous(right) == Some(left) {
                let smaller = evidence.sizes[left].min(evidence.sizes[right]);
                let weight = if pieces[right].continues { SECTION_WEIGHT } else { CONTINUATION_WEIGHT };
                evidence.add_bond(left, right, best * weight * smaller.min(1.0));
            }
        }
    }
}

/// The ends of the pieces of one frame, sorted, so that only those near a gap are compared.
struct FrameEnds<'a> {
    ends: &'a [(End, End)],
    /// First piece of the frame.
    first: usize,
    /// Line pitch of each piece, px.
    pitches_px: Vec<f64>,
    widest_pitch_px: f64,
    /// Pieces by the position where they start, and by that where they end.
    by_start: Vec<usize>,
    by_end: Vec<usize>,
}

impl<'a> FrameEnds<'a> {
    fn new(own: std::ops::Range<usize>, samples: &Samples, ends: &'a [(End, End)]) -> Self {
        let pitch = |piece: usize| samples.of_piece(piece).first().map_or(f64::INFINITY, |sample| sample.pitch_px);
        let pitches_px: Vec<f64> = own.clone().map(pitch).collect();
        let [mut by_start, mut by_end]: [Vec<usize>; 2] = [own.clone().collect(), own.clone().collect()];
        by_start.sort_by(|&a, &b| ends[a].0.along.total_cmp(&ends[b].0.along));
        by_end.sort_by(|&a, &b| ends[a].1.along.total_cmp(&ends[b].1.along));
        let widest_pitch_px = pitches_px.iter().copied().fold(0.0, f64::max);
        Self { ends, first: own.start, pitches_px, widest_pitch_px, by_start, by_end }
    }

    fn strength(&self, left: usize, right: usize) -> Option<f64> {
        continuation(&self.ends[left].1, &self.ends[right].0, self.pitches_px[left - self.first])
    }

    /// The piece that continues `left` best, and how well: the one across the shortest gap.
    fn next(&self, left: usize) -> Option<(usize, f64)> {
        let end = self.ends[left].1.along;
        let pitch_px = self.pitches_px[left - self.first];
        let beyond = self.by_start.partition_point(|&right| self.ends[right].0.along <= end);
        let near =
            self.by_start[beyond..].iter().take_while(|&&right| is_gap(self.ends[right].0.along - end, pitch_px));
        near.copied().find_map(|right| Some((right, self.strength(left, right)?)))
    }

    /// The piece that `right` continues best: gaps count in line pitches, which vary, so that it need not be the one
    /// across the shortest gap. The first of equals.
    fn previous(&self, right: usize) -> Option<usize> {
        let start = self.ends[right].0.along;
        let before = self.by_end.partition_point(|&left| self.ends[left].1.along < start);
        let mut best: Option<(usize, f64)> = None;
        for &left in self.by_end[..before].iter().rev() {
            let most = strength_of_gap(start - self.ends[left].1.along, self.widest_pitch_px);
            if best.is_some_and(|(_, strength)| most < strength) {
                break;
            }
            let Some(strength) = self.strength(left, right) else { continue };
            if best.is_none_or(|(other, most)| strength > most || strength == most && left < other) {
                best = Some((left, strength));
            }
        }
        best.map(|(left, _)| left)
    }
}

/// Adds bonds between pieces that were cut at a kink, since usually it is one line that bends. `joined`: per
/// piece, whether it follows the previous one without a jump.
pub fn add_joints(evidence: &mut Evidence, joined: &[bool]) {
    for idx in (1..joined.len()).filter(|&idx| joined[idx]) {
        let smaller = evidence.sizes[idx - 1].min(evidence.sizes[idx]);
        evidence.add_bond(idx - 1, idx, JOINT_WEIGHT * smaller.min(1.0));
    }
}

/// Whether `b` follows `a` in its segment without a jump. `width_px`: that of the frame's lines in focus.
pub fn joined(a: &Piece, b: &Piece, lines: &Centrelines, width_px: f64, direction: LineDirection) -> bool {
    let trim = cut_trim(width_px);
    if (a.frame, a.segment, a.end + 2 * trim) != (b.frame, b.segment, b.first) {
        return false;
    }
    let points = &lines.segments[a.segment].points;
    let cut = a.end + trim;
    let across = |idx: usize| points[idx].along_across(direction).1;
    (across(cut) - across(cut - 1)).abs() <= largest_step_px(&points[cut], width_px, direction)
}

/// One end of a piece: its position and the line's slope there.
#[derive(Debug, Clone, Copy)]
pub struct End {
    along: f64,
    across: f64,
    slope: f64,
    n_points: usize,
}

/// Both ends of a piece.
pub fn ends_of(points: &[CentrelinePoint], direction: LineDirection) -> (End, End) {
    let n = points.len().min(CONTINUATION_POINTS);
    let (left, right) = (&points[..n], &points[points.len() - n..]);
    (end_of(left, &left[0], direction), end_of(right, &right[n - 1], direction))
}

/// A straight line through points, evaluated in the scan column (row) of `place`.
fn end_of(points: &[CentrelinePoint], place: &CentrelinePoint, direction: LineDirection) -> End {
    let points = || points.iter().map(|point| point.along_across(direction));
    let n = points().len();
    let sum = points().fold((0.0, 0.0), |sum, p| (sum.0 + p.0, sum.1 + p.1));
    let mean = (sum.0 / n as f64, sum.1 / n as f64);
    let (spread, covariance) = points().fold((0.0, 0.0), |(spread, covariance), p| {
        let along = p.0 - mean.0;
        (spread + along * along, covariance + along * (p.1 - mean.1))
    });
    let slope = if spread > 0.0 { covariance / spread } else { 0.0 };
    let along = place.along_across(direction).0;
    End { along, across: mean.1 + slope * (along - mean.0), slope, n_points: n }
}

/// Whether a line may continue across a gap of so many pixels.
fn is_gap(gap: f64, pitch_px: f64) -> bool {
    gap > 0.0 && gap <= CONTINUATION_GAP_PITCHES * pitch_px
}

/// How well `right` continues `left`, 0–1; `None` if it does not.
fn continuation(left: &End, right: &End, pitch_px: f64) -> Option<f64> {
    let gap = right.along - left.along;
    if !is_gap(gap, pitch_px) {
        return None;
    }
    let reaches = |end: &End| gap <= 2.0 * end.n_points as f64;
    let miss_right = (left.across + left.slope * gap - right.across).abs();
    let miss_left = (right.across - right.slope * gap - left.across).abs();
    let near = miss_right.max(miss_left) <= CONTINUATION_GATE_PITCHES * pitch_px;
    let long_enough = gap <= 2.0 || (reaches(left) && reaches(right)) || gap <= 0.25 * pitch_px;
    (near && long_enough).then(|| strength_of_gap(gap, pitch_px))
}

/// Strength of a continuation across a gap.
fn strength_of_gap(gap: f64, pitch_px: f64) -> f64 {
    1.0 / (1.0 + gap / pitch_px)
}
