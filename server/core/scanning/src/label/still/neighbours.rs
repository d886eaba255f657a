//! What the pieces of one frame have to do with each other: who stands above whom, and who goes on where another ends.

use std::ops::Range;

use multiversion::multiversion;
use vision::LineDirection;

use super::super::evidence::kept;
use super::super::pieces::Piece;
use super::super::tracks::{self, End};
use super::lines::Lines;
use super::places::Places;
use crate::params::{CONTINUATION_WEIGHT, CUT_TRIM_POINTS, JOINT_WEIGHT, KINK_STEP_PX, RANK_COST};

/// Another line that shares columns with a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rank {
    /// The other piece.
    pub piece: usize,
    /// Whether the other lies above (left of) this one.
    pub is_above: bool,
    /// What two labels in the wrong order cost.
    pub cost: f64,
}

/// Another piece that is likely of the same label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// The other piece.
    pub piece: usize,
    /// What the same label is worth.
    pub weight: f64,
}

/// Lists of entries, one list a piece, in one memory.
#[derive(Debug)]
pub struct PerPiece<T> {
    starts: Vec<usize>,
    entries: Vec<T>,
    /// What is sorted into lists: piece and entry.
    unsorted: Vec<(usize, T)>,
}

impl<T> Default for PerPiece<T> {
    fn default() -> Self {
        Self { starts: Vec::new(), entries: Vec::new(), unsorted: Vec::new() }
    }
}

impl<T: Copy> PerPiece<T> {
    /// The list of one piece, in the order its entries were added.
    #[inline(always)]
    pub fn of(&self, piece: usize) -> &[T] {
        &self.entries[self.starts[piece]..self.starts[piece + 1]]
    }

    #[inline(always)]
    fn add(&mut self, piece: usize, entry: T) {
        self.unsorted.push((piece, entry));
    }

    fn sort(&mut self, n_pieces: usize) {
        self.starts.clear();
        self.starts.resize(n_pieces + 2, 0);
        for (piece, _) in &self.unsorted {
            self.starts[piece + 2] += 1;
        }
        for piece in 2..self.starts.len() {
            self.starts[piece] += self.starts[piece - 1];
        }
        self.entries.clear();
        if let Some((_, any)) = self.unsorted.first() {
            self.entries.resize(self.unsorted.len(), *any);
        }
        for (piece, entry) in self.unsorted.drain(..) {
            self.entries[self.starts[piece + 1]] = entry;
            self.starts[piece + 1] += 1;
        }
    }
}

/// What pieces have to do with each other, in memory that is kept from frame to frame.
#[derive(Debug, Default)]
pub struct Neighbours {
    /// Who stands above and below.
    pub ranks: PerPiece<Rank>,
    /// Who goes on.
    pub bonds: PerPiece<Bond>,
    /// Per (upper, lower): samples they share.
    shared: Vec<f64>,
    /// Per (left, right): how well the right one continues the left one.
    strengths: Vec<f64>,
    left_ends: Vec<Option<End>>,
    /// Per piece: whether it follows the one before it without a jump.
    pub joined: Vec<bool>,
}

impl Neighbours {
    /// Finds them; the sums are those of [`super::super::ranks`], [`super::super::tracks`] and
    /// [`super::super::evidence`], entry by entry in their order. `pitch_px`: line pitch at a piece.
    pub fn find(&mut self, lines: &Lines, pieces: &[Piece], places: &Places, pitch_px: impl Fn(usize) -> f64) {
        let sizes = &places.sizes;
        self.add_ranks(lines, pieces, places);
        self.ranks.sort(pieces.len());
        self.measure_strengths(lines, pieces, pitch_px);
        self.add_continuations(sizes);
        self.joined.clear();
        self.joined.extend((0..pieces.len()).map(|idx| idx > 0 && joined(&pieces[idx - 1], &pieces[idx], lines)));
        for idx in (1..pieces.len()).filter(|&idx| self.joined[idx]) {
            add_bond(&mut self.bonds, [idx - 1, idx], JOINT_WEIGHT * sizes[idx - 1].min(sizes[idx]).min(1.0));
        }
        self.bonds.sort(pieces.len());
    }

    fn add_ranks(&mut self, lines: &Lines, pieces: &[Piece], places: &Places) {
        let n = pieces.len();
        self.shared.clear();
        self.shared.resize(n * n, 0.0);
        share_samples(lines, pieces, places, &mut self.shared);
        for (pair, share) in self.shared.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let (upper, lower) = (pair / n, pair % n);
            let cost = f64::from(kept(RANK_COST * share));
            self.ranks.add(upper, Rank { piece: lower, is_above: false, cost });
            self.ranks.add(lower, Rank { piece: upper, is_above: true, cost });
        }
    }

    /// Pitches and ends are asked for only where a line may go on.
    fn measure_strengths(&mut self, lines: &Lines, pieces: &[Piece], pitch_px: impl Fn(usize) -> f64) {
        let n = pieces.len();
        let (along, across) = (lines.along(), lines.across());
        self.strengths.clear();
        self.strengths.resize(n * n, 0.0);
        self.left_ends.clear();
        self.left_ends.resize(n, None);
        for left in 0..n {
            let (mut pitch, mut end) = (None, None);
            let range = lines.range(&pieces[left]);
            for right in 0..n {
                let beyond = lines.range(&pieces[right]);
                let gap = along[beyond.start] - along[range.end - 1];
                if !(gap > 0.0 && tracks::is_gap(gap, *pitch.get_or_insert_with(|| pitch_px(left)))) {
                    continue;
                }
                let of = |range: &Range<usize>| (&along[range.clone()], &across[range.clone()]);
                let end = end.get_or_insert_with(|| tracks::right_end(of(&range).0, of(&range).1));
                let start =
                    self.left_ends[right].get_or_insert_with(|| tracks::left_end(of(&beyond).0, of(&beyond).1));
                let pitch = pitch.unwrap_or(f64::NAN);
                self.strengths[left * n + right] = tracks::continuation(end, start, pitch).unwrap_or(0.0);
            }
        }
    }

    fn add_continuations(&mut self, sizes: &[f64]) {
        let n = sizes.len();
        let strength = |left: usize, right: usize| self.strengths[left * n + right];
        for left in 0..n {
            let Some((right, best)) = tracks::strongest(0..n, |right| strength(left, right)) else { continue };
            if tracks::strongest(0..n, |other| strength(other, right)).is_some_and(|(back, _)| back == left) {
                let weight = best * CONTINUATION_WEIGHT * sizes[left].min(sizes[right]).min(1.0);
                add_bond(&mut self.bonds, [left, right], weight);
            }
        }
    }
}

fn add_bond(bonds: &mut PerPiece<Bond>, [a, b]: [usize; 2], weight: f64) {
    let weight = f64::from(kept(weight));
    bonds.add(a, Bond { piece: b, weight });
    bonds.add(b, Bond { piece: a, weight });
}

/// Adds up, per (upper, lower), the samples at which one piece passes above another; each of the two brings half.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn share_samples(lines: &Lines, pieces: &[Piece], places: &Places, shared: &mut [f64]) {
    let n = pieces.len();
    for (a, piece) in pieces.iter().enumerate() {
        for (b, other) in pieces.iter().enumerate().skip(a + 1) {
            let both = if piece.stride == other.stride {
                shared_samples(places, lines.direction, (a, piece), (b, other))
            } else {
                [passes(lines, piece, other), passes(lines, other, piece)]
            };
            let [(above, below), (above_other, below_other)] = both;
            let share = 0.5 * super::super::sample_weight(piece);
            let share_other = 0.5 * super::super::sample_weight(other);
            shared[b * n + a] += above as f64 * share + below_other as f64 * share_other;
            shared[a * n + b] += below as f64 * share + above_other as f64 * share_other;
        }
    }
}

/// At how many samples of `piece` `other` passes above it, and at how many below.
#[inline(always)]
fn passes(lines: &Lines, piece: &Piece, other: &Piece) -> (usize, usize) {
    let (mut along, to) = shared_columns(piece, other);
    let across = lines.across();
    let (own, others) = (&across[lines.range(piece)], &across[lines.range(other)]);
    let (mut above, mut below) = (0, 0);
    while along < to {
        let is_above = others[(along - other.along) as usize] < own[(along - piece.along) as usize];
        above += usize::from(is_above);
        below += usize::from(!is_above);
        along += piece.stride as i64;
    }
    (above, below)
}

/// [`passes`] of both pieces, which have their samples in the same columns.
#[inline(always)]
fn shared_samples(
    places: &Places,
    direction: LineDirection,
    (a, piece): (usize, &Piece),
    (b, other): (usize, &Piece),
) -> [(usize, usize); 2] {
    let (from, to) = shared_columns(piece, other);
    if from >= to {
        return [(0, 0); 2];
    }
    let stride = piece.stride as i64;
    let n = ((to - from + stride - 1) / stride) as usize;
    let first = |piece: &Piece| ((from - first_column(piece.along, stride)) / stride) as usize;
    let own = &places.across(a, direction)[first(piece)..][..n];
    let others = &places.across(b, direction)[first(other)..][..n];
    let (mut n_above, mut n_below) = (0, 0);
    for i in 0..n {
        n_above += u64::from(others[i] < own[i]);
        n_below += u64::from(own[i] < others[i]);
    }
    [n_above, n_below].map(|above| (above as usize, n - above as usize))
}

/// The columns that both pieces have, from the first sample of `piece` on.
#[inline(always)]
fn shared_columns(piece: &Piece, other: &Piece) -> (i64, i64) {
    let end = |piece: &Piece| piece.along + piece.n_points() as i64;
    (first_column(piece.along.max(other.along), piece.stride as i64), end(piece).min(end(other)))
}

/// The next multiple of the stride, which is a power of two.
#[inline(always)]
fn first_column(along: i64, stride: i64) -> i64 {
    (along + stride - 1) & -stride
}

/// Whether `b` follows `a` in its segment without a jump.
fn joined(a: &Piece, b: &Piece, lines: &Lines) -> bool {
    if (a.segment, a.end + 2 * CUT_TRIM_POINTS) != (b.segment, b.first) {
        return false;
    }
    let cut = lines.starts[a.segment] + a.end + CUT_TRIM_POINTS;
    (lines.across()[cut] - lines.across()[cut - 1]).abs() <= KINK_STEP_PX
}
