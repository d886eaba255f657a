//! Another answer tried out on one frame: one piece has a rival label, all that feel it give way.
//!
//! Step by step as [`super::super::trial`] does it for sheets of whole scans; in one frame every piece is a sheet, and
//! order across the image is all that pieces know of each other.

use super::bounds::Bounds;
use super::evidence::Evidence;
use super::lanes::Lanes;
use super::waiting::{self, Waiting};
use crate::params::{CHALLENGE_MARGIN, CHALLENGE_STEPS};

/// Another piece and what it costs to stand in the wrong order beside it, both halves added up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// The other piece.
    pub piece: usize,
    /// Where the other lies above.
    pub above: f64,
    /// Where the other lies below.
    pub below: f64,
}

/// Memory of the trials.
#[derive(Debug, Default)]
pub struct Rivals<const N: usize> {
    /// Per piece, by the other piece; where each list ends.
    sides: Vec<Side>,
    ends: Vec<usize>,
    /// The answer in question, and the one that is tried.
    given: Vec<usize>,
    labels: Vec<usize>,
    /// Per piece and label: what it costs beside the labels of the others.
    costs: Vec<Lanes<N>>,
    /// The same beside the labels of the answer in question.
    given_costs: Vec<Lanes<N>>,
    bounds: Bounds<N>,
    /// Sets of pieces, a bit each. Per piece, word by word: those beside it.
    beside: Vec<u64>,
    /// Those whose label was changed.
    changed: Vec<u64>,
    waiting: Waiting,
    /// How much worse the tried answer is.
    cost: f64,
}

impl<const N: usize> Rivals<N> {
    /// Nothing tried yet.
    #[inline(always)]
    pub fn prepare(&mut self, evidence: &Evidence<N>, labels: &[usize]) {
        self.gather_sides(evidence);
        self.given.clear();
        self.given.extend_from_slice(labels);
        self.labels.clone_from(&self.given);
        self.costs.clear();
        for piece in 0..labels.len() {
            let mut costs = Lanes::splat(0.0);
            for side in self.sides_of(piece) {
                costs = costs
                    .plus(side.above, &evidence.wrong_below[labels[side.piece]])
                    .plus(side.below, &evidence.wrong_above[labels[side.piece]]);
            }
            self.costs.push(costs);
        }
        self.given_costs.clone_from(&self.costs);
        self.waiting.prepare(labels.len(), 2 * labels.len() + CHALLENGE_STEPS);
        self.changed.clear();
        self.changed.resize(waiting::n_words(labels.len()), 0);
        self.bounds.find(evidence, labels, &self.costs, (&self.sides, &self.ends));
    }

    #[inline(always)]
    fn gather_sides(&mut self, evidence: &Evidence<N>) {
        self.sides.clear();
        self.ends.clear();
        self.beside.clear();
        for piece in 0..evidence.sizes.len() {
            let start = self.sides.len();
            for rank in evidence.neighbours.ranks.of(piece) {
                let cost = 2.0 * rank.cost;
                let (above, below) = if rank.is_above { (cost, 0.0) } else { (0.0, cost) };
                let at = start + self.sides[start..].partition_point(|side| side.piece < rank.piece);
                match self.sides.get_mut(at) {
                    Some(side) if side.piece == rank.piece => {
                        side.above += above;
                        side.below += below;
                    }
                    _ => self.sides.insert(at, Side { piece: rank.piece, above, below }),
                }
            }
            self.ends.push(self.sides.len());
            let first = self.beside.len();
            self.beside.resize(first + waiting::n_words(evidence.sizes.len()), 0);
            for side in &self.sides[start..] {
                let (word, bit) = waiting::bit(side.piece);
                self.beside[first + word] |= bit;
            }
        }
    }

    #[inline(always)]
    fn sides_of(&self, piece: usize) -> &[Side] {
        &self.sides[range_of(&self.ends, piece)]
    }

    /// Whether another order of this piece is nearly as good once the others have given way.
    #[inline(always)]
    pub fn has_rival(&mut self, evidence: &Evidence<N>, piece: usize) -> bool {
        let limit = CHALLENGE_MARGIN * evidence.sizes[piece];
        let near = self.bounds.near(evidence, piece, limit) & !(1 << self.given[piece]);
        for rival in waiting::pieces_of(0, near) {
            self.change(evidence, piece, rival);
            let mut falls = self.falls_below(evidence, piece, limit);
            if !falls {
                if !self.is_alone() {
                    self.take_back();
                    self.change(evidence, piece, rival);
                }
                // Where nothing stands in the way, all would be as before.
                falls = self.push_all(evidence, piece) && self.falls_below(evidence, piece, limit);
            }
            self.take_back();
            if falls {
                return true;
            }
        }
        false
    }

    /// Whether the labels of all but one piece are as given.
    #[inline(always)]
    fn is_alone(&self) -> bool {
        self.changed.iter().map(|word| word.count_ones()).sum::<u32>() == 1
    }

    /// What speaks for a label of a piece beside the labels of the others.
    #[inline(always)]
    fn support(&self, evidence: &Evidence<N>, piece: usize, label: usize) -> f64 {
        evidence.single[piece].0[label] - self.costs[piece].0[label]
    }

    #[inline(always)]
    fn change(&mut self, evidence: &Evidence<N>, piece: usize, label: usize) {
        self.cost += self.support(evidence, piece, self.labels[piece]) - self.support(evidence, piece, label);
        let (word, bit) = waiting::bit(piece);
        self.changed[word] |= bit;
        self.relabel(evidence, piece, label);
    }

    /// Costs are multiples of one number ([`super::super::evidence::kept`]): their sums are exact, in whatever sequence.
    #[inline(always)]
    fn relabel(&mut self, evidence: &Evidence<N>, piece: usize, label: usize) {
        let before = std::mem::replace(&mut self.labels[piece], label);
        // For the others, this piece is on the opposite side.
        let above = evidence.wrong_above[label].minus(1.0, &evidence.wrong_above[before]);
        let below = evidence.wrong_below[label].minus(1.0, &evidence.wrong_below[before]);
        for idx in range_of(&self.ends, piece) {
            let side = self.sides[idx];
            self.costs[side.piece] = self.costs[side.piece].plus(side.above, &above).plus(side.below, &below);
        }
    }

    /// Whether another label suits the piece better.
    #[inline(always)]
    fn is_restless(&self, evidence: &Evidence<N>, piece: usize) -> bool {
        let most = self.support(evidence, piece, self.labels[piece]) + LEAST_GAIN;
        let supports = evidence.single[piece].minus(1.0, &self.costs[piece]).0;
        let mut signs = 0;
        for label in 0..N {
            signs |= (most - supports[label]).to_bits();
        }
        signs >> (u64::BITS - 1) != 0
    }

    #[inline(always)]
    fn take_back(&mut self) {
        self.labels.copy_from_slice(&self.given);
        self.costs.copy_from_slice(&self.given_costs);
        self.changed.fill(0);
        self.cost = 0.0;
    }

    /// Shifts by as much whatever stands in the way of what has been shifted: a row of lines gives way only together.
    /// Returns whether anything did.
    #[inline(always)]
    fn push_all(&mut self, evidence: &Evidence<N>, pushing: usize) -> bool {
        let (from, to, none) = (self.given[pushing], self.labels[pushing], evidence.none());
        let mut gives_way = false;
        let mut next = Some(pushing);
        while let Some(piece) = next {
            for word in 0..self.changed.len() {
                let in_the_way = self.in_the_way(piece, none, word);
                for other in waiting::pieces_of(word, in_the_way) {
                    let shifted = (self.labels[other] + to).checked_sub(from).filter(|&label| label < none);
                    self.change(evidence, other, shifted.unwrap_or(none));
                }
                gives_way |= in_the_way != 0;
                self.waiting.add(word, in_the_way);
            }
            next = self.waiting.next();
        }
        self.waiting.forget();
        gives_way
    }

    /// Pieces beside this one that stand in the wrong order and have not been changed: one word of their set.
    #[inline(always)]
    fn in_the_way(&self, piece: usize, none: usize, word: usize) -> u64 {
        let own = self.labels[piece];
        let mut found = 0;
        for side in &self.sides[range_of(&self.ends, piece)] {
            let other = self.labels[side.piece];
            let wrong = (side.above > 0.0) & (other >= own) | (side.below > 0.0) & (other <= own);
            let (its_word, bit) = waiting::bit(side.piece);
            let counts = wrong & (own != none) & (other != none) & (its_word == word);
            found |= if counts { bit } else { 0 };
        }
        found & !self.changed[word]
    }

    /// Lets every piece that feels the changes take its best label, until nothing improves or the cost is below `limit`.
    #[inline(always)]
    fn falls_below(&mut self, evidence: &Evidence<N>, tried: usize, limit: f64) -> bool {
        for word in 0..self.changed.len() {
            for piece in waiting::pieces_of(word, self.changed[word]) {
                self.queue_beside(evidence, piece, self.given[piece]);
                let (word, bit) = waiting::bit(piece);
                self.waiting.add(word, bit);
            }
        }
        for _ in 0..CHALLENGE_STEPS {
            if self.cost < limit {
                break;
            }
            let Some(other) = self.waiting.next() else { break };
            if other == tried || !self.is_restless(evidence, other) {
                continue;
            }
            let current = self.labels[other];
            let (mut best, mut most) = (current, self.support(evidence, other, current) + LEAST_GAIN);
            for label in 0..evidence.n_labels() {
                let support = self.support(evidence, other, label);
                (best, most) = if support > most { (label, support) } else { (best, most) };
            }
            self.change(evidence, other, best);
            self.queue_beside(evidence, other, current);
        }
        self.waiting.forget();
        self.cost < limit
    }

    /// Queues the pieces that feel the change of a label: "none" nobody feels.
    #[inline(always)]
    fn queue_beside(&mut self, evidence: &Evidence<N>, piece: usize, before: usize) {
        if before == evidence.none() && self.labels[piece] == before {
            return;
        }
        let n_words = self.changed.len();
        for word in 0..n_words {
            self.waiting.add(word, self.beside[piece * n_words + word]);
        }
    }
}

/// A label has to be better than another by this much to be taken instead.
const LEAST_GAIN: f64 = 1e-9;

/// Where the sides of a piece are.
#[inline(always)]
fn range_of(ends: &[usize], piece: usize) -> std::ops::Range<usize> {
    (if piece == 0 { 0 } else { ends[piece - 1] })..ends[piece]
}
