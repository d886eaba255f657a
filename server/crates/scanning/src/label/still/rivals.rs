//! Another answer tried out on one frame: one piece has a rival label, all that feel it give way.
//!
//! Step by step as [`super::super::trial`] does it for sheets of whole scans; in one frame every piece is a sheet, and
//! order across the image is all that pieces know of each other.

use super::bounds::Bounds;
use super::evidence::Evidence;
use super::lanes::Lanes;
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
    changed: Vec<usize>,
    is_changed: Vec<bool>,
    /// Pieces that wait to be asked; those before `n_asked` have been.
    waiting: Vec<usize>,
    n_asked: usize,
    queued: Vec<bool>,
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
        self.is_changed.clear();
        self.is_changed.resize(labels.len(), false);
        self.queued.clear();
        self.queued.resize(labels.len(), false);
        self.waiting.reserve(labels.len() + CHALLENGE_STEPS);
        self.changed.reserve(labels.len());
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
        self.bounds.find(evidence, labels, &self.costs, (&self.sides, &self.ends));
    }

    #[inline(always)]
    fn gather_sides(&mut self, evidence: &Evidence<N>) {
        self.sides.clear();
        self.ends.clear();
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
        for rival in 0..evidence.n_orders {
            if rival == self.given[piece] || self.bounds.excludes(evidence, piece, rival, limit) {
                continue;
            }
            for pushing in [false, true] {
                self.change(evidence, piece, rival);
                if pushing {
                    self.push_all(evidence, piece);
                }
                let falls = self.falls_below(evidence, piece, limit);
                self.take_back();
                if falls {
                    return true;
                }
            }
        }
        false
    }

    #[inline(always)]
    fn supports(&self, evidence: &Evidence<N>, piece: usize) -> Lanes<N> {
        evidence.single[piece].minus(1.0, &self.costs[piece])
    }

    #[inline(always)]
    fn change(&mut self, evidence: &Evidence<N>, piece: usize, label: usize) {
        let supports = self.supports(evidence, piece).0;
        self.cost += supports[self.labels[piece]] - supports[label];
        self.relabel(evidence, piece, label);
        if !std::mem::replace(&mut self.is_changed[piece], true) {
            self.changed.push(piece);
        }
    }

    /// Costs are multiples of what single precision resolves: their sums are exact, in whatever sequence.
    #[inline(always)]
    fn relabel(&mut self, evidence: &Evidence<N>, piece: usize, label: usize) {
        let before = std::mem::replace(&mut self.labels[piece], label);
        // For the others, this piece is on the opposite side.
        let above = evidence.wrong_above[label].minus(1.0, &evidence.wrong_above[before]);
        let below = evidence.wrong_below[label].minus(1.0, &evidence.wrong_below[before]);
        for side in &self.sides[range_of(&self.ends, piece)] {
            let costs = &mut self.costs[side.piece];
            *costs = costs.plus(side.above, &above).plus(side.below, &below);
        }
    }

    #[inline(always)]
    fn take_back(&mut self) {
        while let Some(piece) = self.changed.pop() {
            self.is_changed[piece] = false;
            self.labels[piece] = self.given[piece];
            for side in &self.sides[range_of(&self.ends, piece)] {
                self.costs[side.piece] = self.given_costs[side.piece];
            }
        }
        self.cost = 0.0;
    }

    /// Shifts by as much whatever stands in the way of what has been shifted: a row of lines gives way only together.
    #[inline(always)]
    fn push_all(&mut self, evidence: &Evidence<N>, pushing: usize) {
        let (from, to, none) = (self.given[pushing], self.labels[pushing], evidence.none());
        self.waiting.push(pushing);
        while let Some(piece) = self.next_waiting() {
            for idx in range_of(&self.ends, piece) {
                let side = self.sides[idx];
                let (own, other) = (self.labels[piece], self.labels[side.piece]);
                let wrong = side.above > 0.0 && other >= own || side.below > 0.0 && other <= own;
                if own == none || other == none || !wrong || self.is_changed[side.piece] {
                    continue;
                }
                let shifted = (other + to).checked_sub(from).filter(|&label| label < none);
                self.change(evidence, side.piece, shifted.unwrap_or(none));
                self.waiting.push(side.piece);
            }
        }
        self.forget_waiting();
    }

    /// Lets every piece that feels the changes take its best label, until nothing improves or the cost is below `limit`.
    #[inline(always)]
    fn falls_below(&mut self, evidence: &Evidence<N>, tried: usize, limit: f64) -> bool {
        self.changed.sort_unstable();
        for idx in 0..self.changed.len() {
            let piece = self.changed[idx];
            self.queue_touched(evidence, piece, self.given[piece], self.labels[piece]);
            self.queue(piece);
        }
        for _ in 0..CHALLENGE_STEPS {
            if self.cost < limit {
                break;
            }
            let Some(other) = self.next_waiting() else { break };
            self.queued[other] = false;
            if other == tried {
                continue;
            }
            let current = self.labels[other];
            let supports = self.supports(evidence, other).0;
            let (mut best, mut most) = (current, supports[current] + 1e-9);
            let mut n_better = 0;
            for label in 0..N {
                n_better += u64::from(supports[label] > most);
            }
            if n_better == 0 {
                continue;
            }
            for label in 0..evidence.n_labels() {
                (best, most) = if supports[label] > most { (label, supports[label]) } else { (best, most) };
            }
            self.change(evidence, other, best);
            self.queue_touched(evidence, other, current, best);
        }
        while let Some(piece) = self.next_waiting() {
            self.queued[piece] = false;
        }
        self.forget_waiting();
        self.cost < limit
    }

    #[inline(always)]
    fn next_waiting(&mut self) -> Option<usize> {
        let next = self.waiting.get(self.n_asked).copied();
        self.n_asked += usize::from(next.is_some());
        next
    }

    #[inline(always)]
    fn forget_waiting(&mut self) {
        self.waiting.clear();
        self.n_asked = 0;
    }

    /// Puts the pieces that feel a change from one label to another in the queue: "none" nobody feels.
    #[inline(always)]
    fn queue_touched(&mut self, evidence: &Evidence<N>, piece: usize, from: usize, to: usize) {
        if (from, to) == (evidence.none(), evidence.none()) {
            return;
        }
        for idx in range_of(&self.ends, piece) {
            self.queue(self.sides[idx].piece);
        }
    }

    #[inline(always)]
    fn queue(&mut self, piece: usize) {
        if !std::mem::replace(&mut self.queued[piece], true) {
            self.waiting.push(piece);
        }
    }
}

/// Where the sides of a piece are.
#[inline(always)]
fn range_of(ends: &[usize], piece: usize) -> std::ops::Range<usize> {
    (if piece == 0 { 0 } else { ends[piece - 1] })..ends[piece]
}
