//! What another label of a piece costs at the least, whatever the others do: most rivals need no trial.
//!
//! Of all pairs of pieces only those of a tree are looked at. Pairs do nothing but cost, so the best answer to the tree is
//! at least as good as the best answer to all, and it is found exactly: every piece tells its neighbours in the tree how
//! well it and those beyond it fare beside each of their labels, towards the root and back.

use super::evidence::Evidence;
use super::lanes::Lanes;
use super::rivals::Side;

/// What sums of costs may be wrong by, many times over.
const ROUNDING: f64 = 1e-6;

/// Memory of the bounds.
#[derive(Debug, Default)]
pub struct Bounds<const N: usize> {
    /// Pieces in the sequence they joined their tree, each with its pair; a root has none.
    joined: Vec<(usize, Option<Pair>)>,
    /// Per piece that waits: its most telling pair with one that joined, and how telling it is; nothing for those that joined.
    waiting: Vec<(usize, f64, Option<Pair>)>,
    /// Per piece and label: how well all of its tree fare at best; while messages go to the root, those beyond the piece alone.
    at_best: Vec<Lanes<N>>,
    /// Per piece and label of its parent: what it told the parent.
    told: Vec<Lanes<N>>,
    /// How much better all fare at best than with the given answer.
    headroom: f64,
}

/// The pair of a piece and its parent in the tree.
#[derive(Debug, Clone, Copy)]
struct Pair {
    parent: usize,
    /// The piece as the parent sees it.
    side: Side,
}

impl<const N: usize> Bounds<N> {
    /// Finds them for all pieces. `costs`: what every label of a piece costs beside the labels of the others;
    /// `sides_of`: a piece's sides end at `ends[piece]`, one piece after the other.
    #[inline(always)]
    pub fn find(
        &mut self,
        evidence: &Evidence<N>,
        labels: &[usize],
        costs: &[Lanes<N>],
        (sides, ends): (&[Side], &[usize]),
    ) {
        let mut given = 0.0;
        for (piece, &label) in labels.iter().enumerate() {
            // Every pair is seen from both of its pieces.
            given += evidence.single[piece].0[label] - 0.5 * costs[piece].0[label];
        }
        self.grow_trees(labels, sides, ends);
        self.at_best.clear();
        self.at_best.extend_from_slice(evidence.single);
        self.told.clear();
        self.told.resize(labels.len(), Lanes::splat(0.0));
        self.headroom = -given;
        for idx in (0..self.joined.len()).rev() {
            let (piece, pair) = self.joined[idx];
            let Some(pair) = pair else {
                self.headroom += self.at_best[piece].0[self.at_best[piece].largest(evidence.n_labels())];
                continue;
            };
            let told = best_beside(evidence, &self.at_best[piece], pair.side.above, pair.side.below);
            self.told[piece] = told;
            self.at_best[pair.parent] = self.at_best[pair.parent].and(&told);
        }
        for idx in 0..self.joined.len() {
            let (piece, Some(pair)) = self.joined[idx] else { continue };
            let beyond = self.at_best[pair.parent].minus(1.0, &self.told[piece]);
            let told = best_beside(evidence, &beyond, pair.side.below, pair.side.above);
            self.at_best[piece] = self.at_best[piece].and(&told);
        }
    }

    /// The orders of `piece` for which there may be an answer that costs less than `limit` more than the given one, a bit
    /// each.
    #[inline(always)]
    pub fn near(&self, evidence: &Evidence<N>, piece: usize, limit: f64) -> u64 {
        let mut near = 0;
        for order in 0..evidence.n_orders {
            near |= u64::from(self.least_cost(evidence, piece, order) <= limit + ROUNDING) << order;
        }
        near
    }

    /// What an answer costs at the least in which `piece` has a label.
    #[inline(always)]
    fn least_cost(&self, evidence: &Evidence<N>, piece: usize, label: usize) -> f64 {
        let at_best = &self.at_best[piece];
        at_best.0[at_best.largest(evidence.n_labels())] - at_best.0[label] - self.headroom
    }

    /// One tree for pieces that have to do with each other. The most telling pairs are those of neighbouring orders, which
    /// push one another on.
    #[inline(always)]
    fn grow_trees(&mut self, labels: &[usize], sides: &[Side], ends: &[usize]) {
        let Self { joined, waiting, .. } = self;
        joined.clear();
        waiting.clear();
        waiting.extend((0..labels.len()).map(|piece| (piece, 0.0, None)));
        while !waiting.is_empty() {
            let mut next = 0;
            for place in 1..waiting.len() {
                next = if waiting[place].1 > waiting[next].1 { place } else { next };
            }
            let (piece, _, pair) = waiting.swap_remove(next);
            joined.push((piece, pair));
            let own = &sides[if piece == 0 { 0 } else { ends[piece - 1] }..ends[piece]];
            for (other, most, pair) in waiting.iter_mut() {
                let Ok(at) = own.binary_search_by_key(other, |side| side.piece) else { continue };
                let side = own[at];
                let telling = (side.above + side.below) / labels[piece].abs_diff(labels[*other]).max(1) as f64;
                if telling > *most {
                    (*most, *pair) = (telling, Some(Pair { parent: piece, side }));
                }
            }
        }
    }
}

/// How well a piece and those beyond it fare beside every label of another one: `fares` per label of the piece; `above` and
/// `below`: what it costs to stand in the wrong order where the piece lies above the other, and below.
#[inline(always)]
fn best_beside<const N: usize>(evidence: &Evidence<N>, fares: &Lanes<N>, above: f64, below: f64) -> Lanes<N> {
    let mut best = Lanes::splat(f64::NEG_INFINITY);
    for label in 0..evidence.n_labels() {
        let beside = Lanes::splat(fares.0[label])
            .minus(above, &evidence.wrong_below[label])
            .minus(below, &evidence.wrong_above[label]);
        best = best.or(&beside);
    }
    best
}

#[cfg(test)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::super::neighbours::Neighbours;
    use super::*;

    const N_ORDERS: usize = 3;
    const N_PIECES: usize = 5;

    /// Upper and lower piece, and what it costs that they stand in the wrong order.
    type Pairs = Vec<(usize, usize, f64)>;

    /// How well an answer fares, pair by pair.
    fn fares(single: &[Lanes<4>], pairs: &Pairs, labels: &[usize]) -> f64 {
        let wrong = |&&(upper, lower, _): &&(usize, usize, f64)| {
            labels[upper] < N_ORDERS && labels[lower] < N_ORDERS && labels[upper] >= labels[lower]
        };
        let alone: f64 = labels.iter().zip(single).map(|(label, weights)| weights.0[*label]).sum();
        alone - pairs.iter().filter(wrong).map(|pair| pair.2).sum::<f64>()
    }

    fn all_answers() -> impl Iterator<Item = Vec<usize>> {
        let n_labels = N_ORDERS + 1;
        let label = move |answer: usize, piece: usize| answer / n_labels.pow(piece as u32) % n_labels;
        (0..n_labels.pow(N_PIECES as u32)).map(move |answer| (0..N_PIECES).map(|p| label(answer, p)).collect())
    }

    /// The least that a label costs more than the given answer, and its bound.
    fn costs_and_bounds(single: &[Lanes<4>], pairs: &Pairs, given: &[usize]) -> Vec<(f64, f64)> {
        let (mut sides, mut ends) = (Vec::new(), Vec::new());
        for piece in 0..N_PIECES {
            for other in 0..N_PIECES {
                let cost = |upper: usize, lower: usize| {
                    pairs.iter().filter(|pair| (pair.0, pair.1) == (upper, lower)).map(|pair| pair.2).sum::<f64>()
                };
                let (above, below) = (cost(other, piece), cost(piece, other));
                if above + below > 0.0 {
                    sides.push(Side { piece: other, above, below });
                }
            }
            ends.push(sides.len());
        }
        let (sizes, neighbours) = ([1.0; N_PIECES], Neighbours::default());
        let evidence = Evidence::new(N_ORDERS, &sizes, single, &neighbours);
        let mut costs = vec![Lanes::splat(0.0); N_PIECES];
        for &(upper, lower, cost) in pairs {
            costs[upper] = costs[upper].plus(cost, &evidence.wrong_above[given[lower]]);
            costs[lower] = costs[lower].plus(cost, &evidence.wrong_below[given[upper]]);
        }
        let mut bounds = Bounds::default();
        bounds.find(&evidence, given, &costs, (&sides, &ends));
        let mut found = Vec::new();
        for piece in 0..N_PIECES {
            for label in 0..=N_ORDERS {
                let answers = all_answers().filter(|labels| labels[piece] == label);
                let best = answers.map(|labels| fares(single, pairs, &labels)).fold(f64::NEG_INFINITY, f64::max);
                let bound = bounds.least_cost(&evidence, piece, label);
                let is_near = |limit: f64| bounds.near(&evidence, piece, limit) >> label & 1 == 1;
                assert_eq!((is_near(bound), is_near(bound - 2.0 * ROUNDING)), (label < N_ORDERS, false));
                found.push((fares(single, pairs, given) - best, bound));
            }
        }
        found
    }

    fn single(rng: &mut Pcg64Mcg) -> Vec<Lanes<4>> {
        (0..N_PIECES).map(|_| Lanes(std::array::from_fn(|_| -rng.random_range(0.0..3.0)))).collect()
    }

    fn given(rng: &mut Pcg64Mcg) -> Vec<usize> {
        (0..N_PIECES).map(|_| rng.random_range(0..=N_ORDERS)).collect()
    }

    #[test]
    fn no_answer_costs_less_than_its_bound() {
        let mut rng = Pcg64Mcg::seed_from_u64(11);
        let mut n_tight = 0;
        for _ in 0..60 {
            let mut pairs = Pairs::new();
            for upper in 0..N_PIECES {
                for lower in (0..N_PIECES).filter(|lower| *lower != upper) {
                    if rng.random_bool(0.4) {
                        pairs.push((upper, lower, rng.random_range(0.1..3.0)));
                    }
                }
            }
            for (cost, bound) in costs_and_bounds(&single(&mut rng), &pairs, &given(&mut rng)) {
                assert!(bound <= cost + 1e-9, "{bound} is no bound of {cost}");
                n_tight += usize::from(cost - bound < 0.3);
            }
        }
        assert!(n_tight > 100, "{n_tight} bounds of 1,200 say much");
    }

    #[test]
    fn in_a_tree_bounds_are_what_answers_cost() {
        let mut rng = Pcg64Mcg::seed_from_u64(12);
        for _ in 0..40 {
            // The last piece has nothing to do with the others.
            let mut pairs = Pairs::new();
            for lower in 1..N_PIECES - 1 {
                let (upper, cost) = (rng.random_range(0..lower), rng.random_range(0.1..3.0));
                pairs.push(if rng.random_bool(0.5) { (upper, lower, cost) } else { (lower, upper, cost) });
            }
            for (cost, bound) in costs_and_bounds(&single(&mut rng), &pairs, &given(&mut rng)) {
                assert!((cost - bound).abs() < 1e-9, "{bound} for {cost}");
            }
        }
    }
}
