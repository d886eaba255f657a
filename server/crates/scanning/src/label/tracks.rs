//! The same line in the next frame, and the same line beyond a gap.

use vision::{Centrelines, LineDirection};

use super::evidence::Evidence;
use super::hypotheses::Samples;
use super::pieces::{Piece, along_across};
use crate::params::{
    CONTINUATION_GAP_PITCHES, CONTINUATION_GATE_PITCHES, CONTINUATION_POINTS, CONTINUATION_WEIGHT, JOINT_WEIGHT,
    KINK_STEP_PX, TRACK_GATE_PITCHES, TRACK_WEIGHT,
};

/// Per sample: the sample of the same line in the neighbouring frames.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Partners {
    /// In the frame at the next stage position.
    pub next: Vec<Option<usize>>,
    /// In the frame at the stage position before.
    pub previous: Vec<Option<usize>>,
}

/// Pairs samples of one scan column (row) in frames that follow one another along the stage (`travel_order`):
/// nearest both ways and within the gate.
pub fn partners(samples: &Samples, pieces: &[Piece], travel_order: &[usize]) -> Partners {
    let by_frame = samples_by_frame(samples, pieces, travel_order.len());
    let mut partners = Partners { next: vec![None; samples.all.len()], previous: vec![None; samples.all.len()] };
    for pair in travel_order.windows(2) {
        let (here, there) = (&by_frame[pair[0]], &by_frame[pair[1]]);
        for &idx in here {
            let Some(other) = nearest(samples, idx, there) else { continue };
            if nearest(samples, other, here) == Some(idx) {
                partners.next[idx] = Some(other);
                partners.previous[other] = Some(idx);
            }
        }
    }
    partners
}

/// Sample indices of each frame, sorted by column (row).
fn samples_by_frame(samples: &Samples, pieces: &[Piece], n_frames: usize) -> Vec<Vec<usize>> {
    let mut by_frame = vec![Vec::new(); n_frames];
    for (idx, sample) in samples.all.iter().enumerate() {
        by_frame[pieces[sample.piece].frame].push(idx);
    }
    for list in &mut by_frame {
        list.sort_by_key(|&idx| samples.all[idx].along);
    }
    by_frame
}

/// The sample of `candidates` in the same column (row) nearest to `idx` and within the gate.
fn nearest(samples: &Samples, idx: usize, candidates: &[usize]) -> Option<usize> {
    let sample = &samples.all[idx];
    let gate = TRACK_GATE_PITCHES * sample.pitch_px;
    let start = candidates.partition_point(|&other| samples.all[other].along < sample.along);
    let column = candidates[start..].iter().take_while(|&&other| samples.all[other].along == sample.along);
    let (miss, other) = column
        .map(|&other| ((samples.all[other].across_px - sample.across_px).abs(), other))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    (miss <= gate).then_some(other)
}

/// Bonds between partners: the nearer in the image, the stronger.
pub fn add_tracks(evidence: &mut Evidence, samples: &Samples, pieces: &[Piece], partners: &Partners) {
    let mut bonds: Vec<(usize, usize, f64)> = Vec::new();
    for (idx, next) in partners.next.iter().enumerate() {
        let Some(next) = *next else { continue };
        let (a, b) = (&samples.all[idx], &samples.all[next]);
        let miss = (a.across_px - b.across_px) / (TRACK_GATE_PITCHES * a.pitch_px);
        let weight = TRACK_WEIGHT * (1.0 - miss * miss).max(0.0);
        let share = super::sample_weight(&pieces[a.piece]).min(super::sample_weight(&pieces[b.piece]));
        match bonds.last_mut() {
            Some(last) if (last.0, last.1) == (a.piece, b.piece) => last.2 += weight * share,
            _ => bonds.push((a.piece, b.piece, weight * share)),
        }
    }
    for (a, b, weight) in bonds {
        evidence.add_bond(a, b, weight);
    }
}

/// Bonds between pieces of one frame that continue one another beyond a gap.
pub fn add_continuations(
    evidence: &mut Evidence,
    samples: &Samples,
    pieces: &[Piece],
    frames: &[&Centrelines],
    direction: LineDirection,
) {
    let ends: Vec<(End, End)> =
        pieces.iter().map(|piece| ends_of(piece, frames[piece.frame], direction)).collect();
    let mut first = 0;
    while first < pieces.len() {
        let end = first + pieces[first..].iter().take_while(|piece| piece.frame == pieces[first].frame).count();
        for left in first..end {
            for right in first..end {
                let pitch = samples.of_piece(left).first().map_or(f64::INFINITY, |sample| sample.pitch_px);
                let smaller = evidence.sizes[left].min(evidence.sizes[right]);
                if let Some(strength) = continuation(&ends[left].1, &ends[right].0, pitch) {
                    evidence.add_bond(left, right, strength * CONTINUATION_WEIGHT * smaller.min(1.0));
                }
            }
        }
        first = end;
    }
}

/// Bonds between pieces that were cut apart at a kink: usually the line merely bends there.
pub fn add_joints(evidence: &mut Evidence, pieces: &[Piece], frames: &[&Centrelines], direction: LineDirection) {
    for idx in 1..pieces.len() {
        if joined(&pieces[idx - 1], &pieces[idx], frames[pieces[idx].frame], direction) {
            let smaller = evidence.sizes[idx - 1].min(evidence.sizes[idx]);
            evidence.add_bond(idx - 1, idx, JOINT_WEIGHT * smaller.min(1.0));
        }
    }
}

/// Whether `b` follows `a` in its segment without a jump.
pub fn joined(a: &Piece, b: &Piece, lines: &Centrelines, direction: LineDirection) -> bool {
    if (a.frame, a.segment, a.end) != (b.frame, b.segment, b.first) {
        return false;
    }
    let points = &lines.segments[a.segment].points;
    let across = |idx: usize| along_across(&points[idx], direction).1;
    (across(b.first) - across(b.first - 1)).abs() <= KINK_STEP_PX
}

/// One end of a piece: its position and the line's slope there.
#[derive(Debug, Clone, Copy)]
struct End {
    along: f64,
    across: f64,
    slope: f64,
    n_points: usize,
}

fn ends_of(piece: &Piece, lines: &Centrelines, direction: LineDirection) -> (End, End) {
    let points: Vec<(f64, f64)> = piece.points(lines).iter().map(|point| along_across(point, direction)).collect();
    let n = points.len().min(CONTINUATION_POINTS);
    (end_of(&points[..n], points[0].0), end_of(&points[points.len() - n..], points[points.len() - 1].0))
}

/// A straight line through `points`, evaluated at `along`.
fn end_of(points: &[(f64, f64)], along: f64) -> End {
    let n = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
    let (spread, lean) = points.iter().fold((0.0, 0.0), |(spread, lean), p| {
        let along = p.0 - mean.0;
        (spread + along * along, lean + along * (p.1 - mean.1))
    });
    let slope = if spread > 0.0 { lean / spread } else { 0.0 };
    End { along, across: mean.1 + slope * (along - mean.0), slope, n_points: points.len() }
}

/// How well `right` continues `left`, 0–1; `None` if it does not.
fn continuation(left: &End, right: &End, pitch_px: f64) -> Option<f64> {
    let gap = right.along - left.along;
    if !(gap > 0.0 && gap <= CONTINUATION_GAP_PITCHES * pitch_px) {
        return None;
    }
    let reaches = |end: &End| gap <= 2.0 * end.n_points as f64;
    let miss_right = (left.across + left.slope * gap - right.across).abs();
    let miss_left = (right.across - right.slope * gap - left.across).abs();
    let near = miss_right.max(miss_left) <= CONTINUATION_GATE_PITCHES * pitch_px;
    let long_enough = gap <= 2.0 || (reaches(left) && reaches(right)) || gap <= 0.25 * pitch_px;
    (near && long_enough).then(|| 1.0 / (1.0 + gap / pitch_px))
}
