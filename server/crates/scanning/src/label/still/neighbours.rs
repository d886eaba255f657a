//! What the pieces of one frame have to do with each other: who stands above whom, and who goes on where another ends.

use super::super::pieces::Piece;
use super::super::tracks::{self, End};
use super::lines::Lines;
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
    ends: Vec<(End, End)>,
    /// Per piece: whether it follows the one before it without a jump.
    pub joined: Vec<bool>,
}

impl Neighbours {
    /// Finds them; the sums are those of [`super::super::ranks`], [`super::super::tracks`] and
    /// [`super::super::evidence`], entry by entry in their order.
    pub fn find(&mut self, lines: &Lines, pieces: &[Piece], sizes: &[f64], pitches_px: &[f64]) {
        self.add_ranks(lines, pieces);
        self.ranks.sort(pieces.len());
        let ends = |piece: &Piece| {
            let range = lines.range(piece);
            tracks::ends_of(&lines.along()[range.clone()], &lines.across()[range])
        };
        self.ends.clear();
        self.ends.extend(pieces.iter().map(ends));
        self.add_continuations(sizes, pitches_px);
        self.joined.clear();
        self.joined.extend((0..pieces.len()).map(|idx| idx > 0 && joined(&pieces[idx - 1], &pieces[idx], lines)));
        for idx in (1..pieces.len()).filter(|&idx| self.joined[idx]) {
            add_bond(&mut self.bonds, [idx - 1, idx], JOINT_WEIGHT * sizes[idx - 1].min(sizes[idx]).min(1.0));
        }
        self.bonds.sort(pieces.len());
    }

    fn add_ranks(&mut self, lines: &Lines, pieces: &[Piece]) {
        let n = pieces.len();
        self.shared.clear();
        self.shared.resize(n * n, 0.0);
        for (a, piece) in pieces.iter().enumerate() {
            for (b, other) in pieces.iter().enumerate().filter(|(b, _)| *b != a) {
                let (above, below) = shared_samples(lines, piece, other);
                // Each of the two brings half of what they share.
                let share = 0.5 * super::super::sample_weight(piece);
                self.shared[b * n + a] += above as f64 * share;
                self.shared[a * n + b] += below as f64 * share;
            }
        }
        for (pair, share) in self.shared.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let (upper, lower) = (pair / n, pair % n);
            let cost = f64::from((RANK_COST * share) as f32);
            self.ranks.add(upper, Rank { piece: lower, is_above: false, cost });
            self.ranks.add(lower, Rank { piece: upper, is_above: true, cost });
        }
    }

    fn add_continuations(&mut self, sizes: &[f64], pitches_px: &[f64]) {
        let ends = &self.ends;
        let n = ends.len();
        let strength = |left: usize, right: usize| {
            tracks::continuation(&ends[left].1, &ends[right].0, pitches_px[left]).unwrap_or(0.0)
        };
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
    let weight = f64::from(weight as f32);
    bonds.add(a, Bond { piece: b, weight });
    bonds.add(b, Bond { piece: a, weight });
}

/// At how many samples of `piece` `other` passes above it, and at how many below.
#[inline(always)]
fn shared_samples(lines: &Lines, piece: &Piece, other: &Piece) -> (usize, usize) {
    let stride = piece.stride as i64;
    let end = |piece: &Piece| piece.along + piece.n_points() as i64;
    let from = piece.along.max(other.along);
    // The next multiple of the stride, which is a power of two.
    let mut along = (from + stride - 1) & -stride;
    let to = end(piece).min(end(other));
    let across = lines.across();
    let (own, others) = (&across[lines.range(piece)], &across[lines.range(other)]);
    let (mut above, mut below) = (0, 0);
    while along < to {
        let is_above = others[(along - other.along) as usize] < own[(along - piece.along) as usize];
        above += usize::from(is_above);
        below += usize::from(!is_above);
        along += stride;
    }
    (above, below)
}

/// Whether `b` follows `a` in its segment without a jump.
fn joined(a: &Piece, b: &Piece, lines: &Lines) -> bool {
    if (a.segment, a.end + 2 * CUT_TRIM_POINTS) != (b.segment, b.first) {
        return false;
    }
    let cut = lines.starts[a.segment] + a.end + CUT_TRIM_POINTS;
    (lines.across()[cut] - lines.across()[cut - 1]).abs() <= KINK_STEP_PX
}
