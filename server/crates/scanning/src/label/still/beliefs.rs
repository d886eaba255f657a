//! Beliefs relaxed together, all labels of a piece at once; [`super::super::relax`] says why.

use super::evidence::Evidence;
use super::lanes::Lanes;
use crate::params::{RELAX_ROUNDS, RELAX_SHARPNESS, UNLABELLED_FROM};

/// How much each label of each piece is believed, in memory that is kept from frame to frame.
#[derive(Debug, Default)]
pub struct Beliefs<const N: usize> {
    beliefs: Vec<Lanes<N>>,
    fresh: Vec<Lanes<N>>,
    /// Per piece and label: belief in this label or a lower one, in this one or a higher one; nothing for "none".
    at_most: Vec<Lanes<N>>,
    at_least: Vec<Lanes<N>>,
}

impl<const N: usize> Beliefs<N> {
    /// The most believed label of every piece.
    #[inline(always)]
    pub fn relax(&mut self, evidence: &Evidence<N>, labels: &mut Vec<usize>) {
        let n_pieces = evidence.sizes.len();
        let mut even = Lanes::splat(0.0);
        for label in 0..evidence.n_labels() {
            even.0[label] = 1.0 / evidence.n_labels() as f64;
        }
        for list in [&mut self.beliefs, &mut self.fresh, &mut self.at_most, &mut self.at_least] {
            list.clear();
            list.resize(n_pieces, even);
        }
        for round in 0..RELAX_ROUNDS {
            let progress = round as f64 / (RELAX_ROUNDS - 1) as f64;
            let sharpness = RELAX_SHARPNESS[0] * (RELAX_SHARPNESS[1] / RELAX_SHARPNESS[0]).powf(progress);
            self.add_up(evidence.n_orders);
            self.ask(evidence, sharpness, progress >= UNLABELLED_FROM);
            for piece in 0..n_pieces {
                self.beliefs[piece] = Lanes::splat(0.0).plus(0.5, &self.beliefs[piece].and(&self.fresh[piece]));
            }
        }
        labels.clear();
        for belief in &self.beliefs {
            labels.push(belief.largest(evidence.n_labels()));
        }
    }

    #[inline(always)]
    fn add_up(&mut self, n_orders: usize) {
        for piece in 0..self.beliefs.len() {
            let belief = &self.beliefs[piece].0;
            let (mut at_most, mut at_least) = (Lanes::splat(0.0), Lanes::splat(0.0));
            let (mut below, mut above) = (0.0, 0.0);
            for i in 0..n_orders {
                let from_above = n_orders - 1 - i;
                below += belief[i];
                above += belief[from_above];
                at_most.0[i] = below;
                at_least.0[from_above] = above;
            }
            self.at_most[piece] = at_most;
            self.at_least[piece] = at_least;
        }
    }

    /// What every piece believes, given what the others did.
    #[inline(always)]
    fn ask(&mut self, evidence: &Evidence<N>, sharpness: f64, none_takes_part: bool) {
        for piece in 0..self.beliefs.len() {
            let mut support = Lanes::splat(0.0);
            for bond in evidence.neighbours.bonds.of(piece) {
                support = support.plus(bond.weight, &self.beliefs[bond.piece]);
            }
            for rank in evidence.neighbours.ranks.of(piece) {
                let theirs = if rank.is_above { &self.at_least } else { &self.at_most };
                support = support.minus(rank.cost, &theirs[rank.piece]);
            }
            let mut support = evidence.single[piece].and(&support).over(evidence.sizes[piece]);
            if !none_takes_part {
                support.0[evidence.none()] = f64::NEG_INFINITY;
            }
            self.fresh[piece] = support.softmax(sharpness);
        }
    }
}
