//! The same line in the next frame, and the same line beyond a gap.

use std::collections::BTreeMap;

use vision::{Centrelines, LineDirection};

use super::evidence::Evidence;
use super::hypotheses::{Sample, Samples};
use crate::error::ScanError;
use crate::input::frames::{Frames, lines_of};
use crate::input::line_step::largest_step_px;
use crate::label::columns::{Columns, pieces_of};
use crate::label::pieces::{Piece, cut_trim};
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
    let mut bonds: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    let mut before = travel_order.first().map(|&frame| lines_of(frames, frame)).transpose()?;
    for pair in travel_order.windows(2) {
        let (Some(behind), ahead) = (before.take(), lines_of(frames, pair[1])?) else { break };
        let columns = |frame: usize, lines| Columns { pieces, own: pieces_of(pieces, frame), lines, direction };
        let (here, there) = (columns(pair[0], &*behind), columns(pair[1], &*ahead));
        for (here, there, side) in [(&here, &there, &mut partners.next), (&there, &here, &mut partners.previous)] {
            for piece in here.own.clone() {
                for idx in samples.range(piece) {
                    let Some((other, closeness)) = followed(&samples.all[idx], here, there) else { continue };
                    side[idx] = samples.at(other, &pieces[other], samples.all[idx].along);
                    // Each side of the bond contributes half.
                    let weight = 0.5 * TRACK_WEIGHT * closeness * crate::label::sample_weight(&pieces[piece]);
                    *bonds.entry((piece.min(other), piece.max(other))).or_default() += weight;
                }
            }
        }
        before = Some(ahead);
    }
    for ((a, b), weight) in bonds {
        evidence.add_bond(a, b, weight);
    }
    Ok(partners)
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
    let mut first = 0;
    while first < pieces.len() {
        let end = first + pieces[first..].iter().take_while(|piece| piece.frame == pieces[first].frame).count();
        let pitch = |left: usize| samples.of_piece(left).first().map_or(f64::INFINITY, |sample| sample.pitch_px);
        let strength =
            |left: usize, right: usize| continuation(&ends[left].1, &ends[right].0, pitch(left)).unwrap_or(0.0);
        for left in first..end {
            // A line is continued only by its next piece, however many follow: support for a label must not grow with
            // the number of pieces into which a line was cut.
            let Some((right, best)) = strongest(first..end, |right| strength(left, right)) else { continue };
            if strongest(first..end, |other| strength(other, right)).is_some_and(|(back, _)| back == left) {
                let smaller = evidence.sizes[left].min(evidence.sizes[right]);
                let weight = if pieces[right].continues { SECTION_WEIGHT } else { CONTINUATION_WEIGHT };
                evidence.add_bond(left, right, best * weight * smaller.min(1.0));
            }
        }
        first = end;
    }
}

/// The piece with the largest strength above zero, the first of equals.
fn strongest(pieces: std::ops::Range<usize>, strength: impl Fn(usize) -> f64) -> Option<(usize, f64)> {
    let strengths = pieces.map(|piece| (piece, strength(piece))).filter(|(_, strength)| *strength > 0.0);
    strengths.fold(None, |best, next| match best {
        Some((_, strength)) if strength >= next.1 => best,
        _ => Some(next),
    })
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

/// Both ends of a piece whose points lie at `along` and `across`, px.
pub fn ends_of(along: &[f64], across: &[f64]) -> (End, End) {
    (left_end(along, across), right_end(along, across))
}

/// The left end of a piece.
fn left_end(along: &[f64], across: &[f64]) -> End {
    let n = along.len().min(CONTINUATION_POINTS);
    end_of(&along[..n], &across[..n], along[0])
}

/// The right end of a piece.
fn right_end(along: &[f64], across: &[f64]) -> End {
    let last = along.len() - 1;
    let tail = along.len() - along.len().min(CONTINUATION_POINTS);
    end_of(&along[tail..], &across[tail..], along[last])
}

/// A straight line through points, evaluated at `place`.
fn end_of(along: &[f64], across: &[f64], place: f64) -> End {
    let points = || along.iter().zip(across);
    let n = along.len() as f64;
    let mean = points().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
    let (spread, covariance) = points().fold((0.0, 0.0), |(spread, covariance), p| {
        let along = p.0 - mean.0;
        (spread + along * along, covariance + along * (p.1 - mean.1))
    });
    let slope = if spread > 0.0 { covariance / spread } else { 0.0 };
    End { along: place, across: mean.1 + slope * (place - mean.0), slope, n_points: along.len() }
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
    (near && long_enough).then(|| 1.0 / (1.0 + gap / pitch_px))
}
