//! Beliefs relaxed together, eight pieces beside one another; [`super::super::relax`] says why.

use std::sync::LazyLock;

use super::evidence::Evidence;
use super::softmax::share;
use crate::params::{RELAX_ROUNDS, RELAX_SHARPNESS, UNLABELLED_FROM};

/// Pieces of a block: what a vector register holds.
pub const BLOCK: usize = 8;

/// What a piece tells: its beliefs, for those that it is bound to.
const BELIEFS: usize = 0;
/// Per label: belief in this one or a lower one, for those above it; nothing for "none".
const UP_TO: usize = 1;
/// Per label: belief in this one or a higher one, for those below it; nothing for "none".
const FROM: usize = 2;

/// What the pieces of a block tell, label by label: [`BELIEFS`], [`UP_TO`] and [`FROM`].
type Told<const N: usize> = [[[f64; BLOCK]; N]; 3];

/// What a piece tells of one kind, and what it weighs for every piece of a block.
#[derive(Debug, Clone, Copy)]
struct Weights {
    kind: usize,
    piece: usize,
    weights: [f64; BLOCK],
}

/// What speaks for the labels of the pieces of a block beside what others tell, and one by the size of each piece.
#[derive(Debug, Clone, Copy)]
struct Alone<const N: usize> {
    single: [[f64; BLOCK]; N],
    by_size: [f64; BLOCK],
}

/// How much each label of each piece is believed, in memory that is kept from frame to frame.
#[derive(Debug, Default)]
pub struct Beliefs<const N: usize> {
    alone: Vec<Alone<N>>,
    /// Block by block, and where each block's end.
    weights: Vec<Weights>,
    ends: Vec<usize>,
    /// Per kind and piece: where the weights of the block at hand are.
    places: Vec<[Option<usize>; 3]>,
    told: Vec<Told<N>>,
    told_next: Vec<Told<N>>,
}

/// Sharpness of the shares in every round.
static SHARPNESS: LazyLock<[f64; RELAX_ROUNDS]> = LazyLock::new(|| {
    std::array::from_fn(|round| {
        RELAX_SHARPNESS[0] * (RELAX_SHARPNESS[1] / RELAX_SHARPNESS[0]).powf(progress(round))
    })
});

fn progress(round: usize) -> f64 {
    round as f64 / (RELAX_ROUNDS - 1) as f64
}

impl<const N: usize> Beliefs<N> {
    /// The most believed label of every piece.
    #[inline(always)]
    pub fn relax(&mut self, evidence: &Evidence<N>, labels: &mut Vec<usize>) {
        self.take_blocks(evidence);
        self.weigh(evidence);
        self.believe_evenly(evidence);
        for (round, &sharpness) in SHARPNESS.iter().enumerate() {
            let is_late = progress(round) >= UNLABELLED_FROM;
            let n_labels = if is_late { evidence.n_labels() } else { evidence.n_orders };
            match evidence.n_labels() {
                0..=4 => self.go_on::<4>(evidence.n_orders, n_labels, sharpness),
                5..=6 => self.go_on::<6>(evidence.n_orders, n_labels, sharpness),
                7..=8 => self.go_on::<8>(evidence.n_orders, n_labels, sharpness),
                _ => self.go_on::<N>(evidence.n_orders, n_labels, sharpness),
            }
            std::mem::swap(&mut self.told, &mut self.told_next);
        }
        labels.clear();
        for piece in 0..evidence.sizes.len() {
            let beliefs = &self.told[piece / BLOCK][BELIEFS];
            let (mut best, mut most) = (0, beliefs[0][piece % BLOCK]);
            for label in 1..evidence.n_labels() {
                let belief = beliefs[label][piece % BLOCK];
                (best, most) = if belief > most { (label, belief) } else { (best, most) };
            }
            labels.push(best);
        }
    }

    /// What every piece brings itself. The last block is filled up with pieces that tell nobody anything.
    #[inline(always)]
    fn take_blocks(&mut self, evidence: &Evidence<N>) {
        let nobody = Alone { single: [[0.0; BLOCK]; N], by_size: [1.0; BLOCK] };
        self.alone.clear();
        self.alone.resize(evidence.sizes.len().div_ceil(BLOCK), nobody);
        for (piece, size) in evidence.sizes.iter().enumerate() {
            let alone = &mut self.alone[piece / BLOCK];
            alone.by_size[piece % BLOCK] = 1.0 / size;
            for label in 0..N {
                alone.single[label][piece % BLOCK] = evidence.single[piece].0[label];
            }
        }
    }

    /// What weighs how much for whom.
    #[inline(always)]
    fn weigh(&mut self, evidence: &Evidence<N>) {
        let n_pieces = evidence.sizes.len();
        self.weights.clear();
        self.ends.clear();
        for first in (0..n_pieces).step_by(BLOCK) {
            self.places.clear();
            self.places.resize(n_pieces, [None; 3]);
            for piece in first..n_pieces.min(first + BLOCK) {
                for bond in evidence.neighbours.bonds.of(piece) {
                    self.add(piece, BELIEFS, bond.piece, bond.weight);
                }
                for rank in evidence.neighbours.ranks.of(piece) {
                    self.add(piece, if rank.is_above { FROM } else { UP_TO }, rank.piece, -rank.cost);
                }
            }
            self.ends.push(self.weights.len());
        }
    }

    #[inline(always)]
    fn add(&mut self, listener: usize, kind: usize, piece: usize, weight: f64) {
        let place = &mut self.places[piece][kind];
        let place = *place.get_or_insert(self.weights.len());
        if place == self.weights.len() {
            self.weights.push(Weights { kind, piece, weights: [0.0; BLOCK] });
        }
        self.weights[place].weights[listener % BLOCK] += weight;
    }

    /// At first every label is believed as much as every other.
    #[inline(always)]
    fn believe_evenly(&mut self, evidence: &Evidence<N>) {
        let mut even = [[0.0; BLOCK]; N];
        for label in 0..evidence.n_labels() {
            even[label] = [1.0 / evidence.n_labels() as f64; BLOCK];
        }
        let mut told = [[[0.0; BLOCK]; N]; 3];
        tell(&even, evidence.n_orders, &mut told);
        self.told.clear();
        self.told.resize(self.alone.len(), told);
        self.told_next.clone_from(&self.told);
    }

    /// One round: of `L` labels, which are all that the station has and perhaps more, the first `n_labels` take part.
    #[inline(always)]
    fn go_on<const L: usize>(&mut self, n_orders: usize, n_labels: usize, sharpness: f64) {
        let mut handicaps = [0.0; L];
        handicaps[n_labels..].fill(f64::NEG_INFINITY);
        let mut start = 0;
        for (block, alone) in self.alone.iter().enumerate() {
            let weights = &self.weights[start..self.ends[block]];
            start = self.ends[block];
            let mut shares = supports::<N, L>(alone, weights, &self.told, &handicaps);
            share(&mut shares, sharpness);
            let before = &self.told[block][BELIEFS];
            let mut beliefs = [[0.0; BLOCK]; L];
            for label in 0..L {
                let mut belief = before[label];
                for i in 0..BLOCK {
                    belief[i] = 0.5 * (belief[i] + shares[label][i]);
                }
                beliefs[label] = belief;
            }
            tell(&beliefs, n_orders, &mut self.told_next[block]);
        }
    }
}

/// What speaks for the labels of the pieces of a block, given what all tell. `handicaps`: nothing for labels that take
/// part, minus infinity for the others.
#[inline(always)]
fn supports<const N: usize, const L: usize>(
    alone: &Alone<N>,
    weights: &[Weights],
    told: &[Told<N>],
    handicaps: &[f64; L],
) -> [[f64; BLOCK]; L] {
    let mut sums = [[0.0; BLOCK]; L];
    for Weights { kind, piece, weights } in weights {
        let told = &told[piece / BLOCK][*kind];
        for label in 0..L {
            let told = told[label][piece % BLOCK];
            for i in 0..BLOCK {
                sums[label][i] += weights[i] * told;
            }
        }
    }
    for label in 0..L {
        for i in 0..BLOCK {
            sums[label][i] = alone.by_size[i] * (alone.single[label][i] + sums[label][i]) + handicaps[label];
        }
    }
    sums
}

/// What the pieces of a block tell that believe this.
#[inline(always)]
fn tell<const N: usize, const L: usize>(beliefs: &[[f64; BLOCK]; L], n_orders: usize, told: &mut Told<N>) {
    told[BELIEFS][..L].copy_from_slice(beliefs);
    let (mut below, mut above) = ([0.0; BLOCK], [0.0; BLOCK]);
    for label in 0..n_orders.min(L) {
        let from_above = n_orders - 1 - label;
        for i in 0..BLOCK {
            below[i] += beliefs[label][i];
            above[i] += beliefs[from_above][i];
        }
        (told[UP_TO][label], told[FROM][from_above]) = (below, above);
    }
}
