//! Bounds on the score of a single frame, in which lines depend on each other by their ranks and by bonds alone.
//!
//! Between two ends of lines the same lines run below one another: an *interval*. The terms of every piece, and of every two
//! that are neighbours, are divided among their intervals by length. An interval alone is solved exactly, from line to line
//! (Viterbi 1967). No labelling scores more than the sum of these optima (dual decomposition); where all intervals agree, it
//! is the best one.

use vision::{Centrelines, LineDirection};

use super::conditional_modes::ConditionalModes;
use super::inference::{all_pieces, total_score};
use crate::label::gather::evidence::Evidence;
use crate::label::pieces::Piece;

/// Scores that differ by less, in samples, may be equal.
const ROUNDING: f64 = 1e-6;

/// What the pieces of a frame score at most with each label of each piece.
pub struct IntervalBounds {
    n_labels: usize,
    /// Bound of the total score without bonds.
    top: f64,
    /// Per piece and label: how much lower the bound is with this label.
    losses: Vec<f64>,
}

/// Terms and best scores of one interval; the memory is used for the next.
#[derive(Default)]
struct Chain {
    /// Per piece and label.
    own: Vec<f64>,
    /// Per piece but the last: cost of it and the next in the wrong order.
    costs: Vec<f64>,
    /// Per piece and label: best score of the piece with all above it.
    above: Vec<f64>,
    /// The same with all below it.
    below: Vec<f64>,
}

/// Columns (rows) between two ends of pieces, and the pieces that cross them, the uppermost (leftmost) first.
struct Interval {
    n_columns: i64,
    pieces: Vec<usize>,
}

impl IntervalBounds {
    /// For the pieces of a frame, whose evidence has no repeated observations.
    pub fn new(evidence: &Evidence, pieces: &[Piece], lines: &Centrelines, direction: LineDirection) -> Self {
        let n = evidence.n_labels;
        let mut bounds = Self { n_labels: n, top: 0.0, losses: vec![0.0; evidence.unary.len()] };
        let mut chain = Chain::default();
        for interval in intervals(pieces, lines, direction) {
            let share = |n_columns: i64| interval.n_columns as f64 / n_columns as f64;
            chain.own.clear();
            for &piece in &interval.pieces {
                let share = share(pieces[piece].n_points() as i64);
                chain.own.extend(evidence.unary[piece * n..][..n].iter().map(|unary| unary * share));
            }
            let cost = |pair: &[usize]| {
                let [upper, lower] = [pair[0], pair[1]].map(|piece| &pieces[piece]);
                let shared = upper.end_along().min(lower.end_along()) - upper.along.max(lower.along);
                let ranks = evidence.ranks[pair[0]].iter();
                let of_pair = ranks.filter(|rank| !rank.is_above && rank.piece as usize == pair[1]);
                // Both pieces bear the cost.
                2.0 * share(shared) * of_pair.map(|rank| f64::from(rank.cost)).sum::<f64>()
            };
            chain.costs.clear();
            chain.costs.extend(interval.pieces.windows(2).map(cost));
            bounds.add(&interval.pieces, &mut chain);
        }
        bounds
    }

    /// Adds the bounds of an interval.
    fn add(&mut self, pieces: &[usize], Chain { own, costs, above, below }: &mut Chain) {
        let (n, none) = (self.n_labels, self.n_labels - 1);
        above.clone_from(own);
        below.clone_from(own);
        for (place, &cost) in costs.iter().enumerate() {
            let (upper, lower) = above.split_at_mut((place + 1) * n);
            carry(&upper[place * n..], &mut lower[..n], cost, 0..none);
        }
        for (place, &cost) in costs.iter().enumerate().rev() {
            let (upper, lower) = below.split_at_mut((place + 1) * n);
            carry(&lower[..n], &mut upper[place * n..], cost, (0..none).rev());
        }
        let top = below[..n].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        self.top += top;
        for (place, &piece) in pieces.iter().enumerate() {
            for (label, loss) in self.losses[piece * n..][..n].iter_mut().enumerate() {
                let slot = place * n + label;
                *loss += top - (above[slot] + below[slot] - own[slot]);
            }
        }
    }

    /// How much less these labels score than the bound, bonds left out.
    pub fn headroom(&self, evidence: &Evidence, labels: &[usize]) -> f64 {
        let kept_bonds = (0..labels.len()).flat_map(|piece| {
            evidence.bonds[piece].iter().filter(move |bond| labels[bond.piece as usize] == labels[piece])
        });
        let in_bonds: f64 = kept_bonds.map(|bond| f64::from(bond.weight)).sum();
        self.top - (total_score(evidence, labels) - in_bonds)
    }

    /// How much lower the bound is if `piece` has this label.
    pub fn loss(&self, piece: usize, label: usize) -> f64 {
        self.losses[piece * self.n_labels + label]
    }

    /// The labels that the best labelling has for certain, `None` where the bounds leave several.
    pub fn certain_labels(&self, evidence: &Evidence) -> Vec<Option<usize>> {
        let least_loss = |losses: &[f64]| {
            let better = |best: usize, label: usize| if losses[label] < losses[best] { label } else { best };
            (0..losses.len()).fold(0, better)
        };
        let mut labels: Vec<usize> = self.losses.chunks_exact(self.n_labels).map(least_loss).collect();
        ConditionalModes::new(evidence).improve(&mut labels, &all_pieces(evidence));
        let bonds: f64 = evidence.bonds.iter().flatten().map(|bond| f64::from(bond.weight)).sum();
        // No labelling with a larger loss is the best: this one is better.
        let limit = self.top + bonds - total_score(evidence, &labels) + ROUNDING;
        let only_label = |losses: &[f64]| {
            let mut possible = (0..losses.len()).filter(|&label| losses[label] < limit);
            possible.next().filter(|_| possible.next().is_none())
        };
        self.losses.chunks_exact(self.n_labels).map(only_label).collect()
    }
}

/// Adds to each label of a line the best score of a neighbour `from`, which costs `cost` more in the wrong order.
/// `orders`: from those that are right for all of the neighbour's on.
fn carry(from: &[f64], to: &mut [f64], cost: f64, orders: impl Iterator<Item = usize>) {
    let none = from.len() - 1;
    let best = from.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut best_right = from[none];
    for order in orders {
        to[order] += best_right.max(best - cost);
        best_right = best_right.max(from[order]);
    }
    to[none] += best;
}

fn intervals(pieces: &[Piece], lines: &Centrelines, direction: LineDirection) -> Vec<Interval> {
    let mut ends: Vec<i64> = pieces.iter().flat_map(|piece| [piece.along, piece.end_along()]).collect();
    ends.sort_unstable();
    ends.dedup();
    let between = |ends: &[i64]| {
        let middle = (ends[0] + ends[1]) / 2;
        let crossing =
            |(idx, piece): (usize, &Piece)| Some((piece.point_at(lines, middle)?.along_across(direction).1, idx));
        let mut crossings: Vec<(f64, usize)> = pieces.iter().enumerate().filter_map(crossing).collect();
        crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        Interval { n_columns: ends[1] - ends[0], pieces: crossings.into_iter().map(|(_, idx)| idx).collect() }
    };
    ends.windows(2).map(between).filter(|interval| !interval.pieces.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;
    use vision::{CentrelinePoint, Segment};

    use super::*;

    const N_ORDERS: usize = 3;

    /// A frame of `n` level pieces between random columns, and the evidence of random depths, ranks and bonds.
    fn frame(n: usize, rng: &mut Pcg64Mcg) -> (Evidence, Vec<Piece>, Centrelines) {
        let (mut lines, mut pieces) = (Centrelines::default(), Vec::new());
        for segment in 0..n {
            let along = rng.random_range(0..60);
            let n_points = rng.random_range(8..60);
            let across_px = 10.0 * segment as f64;
            let point = |column: usize| {
                let u_px = (along + column) as f64;
                CentrelinePoint { u_px, v_px: across_px, ..CentrelinePoint::UNWRITTEN }
            };
            lines.segments.push(Segment { points: (0..n_points).map(point).collect() });
            let along = along as i64;
            pieces.push(Piece { frame: 0, segment, first: 0, end: n_points, along, stride: 1, continues: false });
        }
        let sizes: Vec<f64> = pieces.iter().map(|piece| piece.n_points() as f64).collect();
        let mut evidence = Evidence::new(N_ORDERS, sizes, 0.4);
        for (lower, piece) in pieces.iter().enumerate() {
            for order in (0..N_ORDERS).filter(|_| rng.random_bool(0.4)) {
                evidence.add_unary(lower, order, -1.5 * piece.n_points() as f64);
            }
            for (upper, other) in pieces[..lower].iter().enumerate() {
                let shared = piece.end_along().min(other.end_along()) - piece.along.max(other.along);
                if shared > 0 {
                    evidence.add_rank(upper, lower, 1.5 * shared as f64);
                } else if rng.random_bool(0.2) {
                    evidence.add_bond(upper, lower, 2.0);
                }
            }
        }
        (evidence, pieces, lines)
    }

    /// All labellings of `n` pieces.
    fn labellings(n: usize) -> impl Iterator<Item = Vec<usize>> {
        let n_labels = N_ORDERS + 1;
        (0..n_labels.pow(n as u32))
            .map(move |code| (0..n).map(|at| code / n_labels.pow(at as u32) % n_labels).collect())
    }

    #[test]
    fn no_labels_score_more_than_their_bound_and_certain_labels_are_the_best() {
        let (mut rng, n) = (Pcg64Mcg::seed_from_u64(3), 5);
        let (mut n_certain, mut n_above_zero) = (0, 0);
        for _ in 0..60 {
            let (evidence, pieces, lines) = frame(n, &mut rng);
            let bounds = IntervalBounds::new(&evidence, &pieces, &lines, LineDirection::Rows);
            for labels in labellings(n) {
                let headroom = bounds.headroom(&evidence, &labels);
                for (piece, &label) in labels.iter().enumerate() {
                    let loss = bounds.loss(piece, label);
                    assert!(headroom > loss - 1e-9, "{labels:?}, piece {piece}: {headroom} and {loss}");
                    n_above_zero += usize::from(loss > 1e-9);
                }
            }
            let score = |labels: &Vec<usize>| total_score(&evidence, labels);
            let best = labellings(n).max_by(|a, b| score(a).total_cmp(&score(b))).unwrap();
            for (certain, label) in bounds.certain_labels(&evidence).into_iter().zip(best) {
                assert!(certain.is_none_or(|certain| certain == label), "{certain:?} and {label}");
                n_certain += usize::from(certain.is_some());
            }
        }
        assert!(n_certain > 60 && n_above_zero > 100_000, "{n_certain} of 300 certain, {n_above_zero} losses");
    }
}
