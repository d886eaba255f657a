//! Beliefs relaxed together, all labels of a piece at once; [`super::super::relax`] says why.

use super::evidence::Evidence;
use super::lanes::Lanes;
use super::softmax::{self, Softmax};
use crate::params::{RELAX_ROUNDS, RELAX_SHARPNESS, UNLABELLED_FROM};

/// How much each label of each piece is believed, in memory that is kept from frame to frame.
#[derive(Debug, Default)]
pub struct Beliefs<const N: usize> {
    beliefs: Vec<Lanes<N>>,
    /// Per piece and label: what speaks for it.
    supports: Vec<[f64; N]>,
    /// Per piece: one by its size.
    by_size: Vec<f64>,
    softmax: Softmax,
    /// Per piece and label: belief in this label or a lower one, then in this one or a higher one; nothing for "none".
    up_to_and_from: Vec<[Lanes<N>; 2]>,
}

impl<const N: usize> Beliefs<N> {
    /// The most believed label of every piece.
    #[inline(always)]
    pub fn relax(&mut self, evidence: &Evidence<N>, labels: &mut Vec<usize>) {
        let n_pieces = evidence.sizes.len();
        let width = softmax::width(n_pieces);
        let mut even = Lanes::splat(0.0);
        for label in 0..evidence.n_labels() {
            even.0[label] = 1.0 / evidence.n_labels() as f64;
        }
        self.beliefs.clear();
        self.beliefs.resize(n_pieces, even);
        self.by_size.clear();
        self.by_size.extend(evidence.sizes.iter().map(|size| 1.0 / size));
        self.up_to_and_from.clear();
        self.up_to_and_from.resize(n_pieces, [Lanes::splat(0.0); 2]);
        for round in 0..RELAX_ROUNDS {
            let progress = round as f64 / (RELAX_ROUNDS - 1) as f64;
            let sharpness = RELAX_SHARPNESS[0] * (RELAX_SHARPNESS[1] / RELAX_SHARPNESS[0]).powf(progress);
            self.add_up(evidence.n_orders);
            self.ask(evidence);
            let n_labels = if progress >= UNLABELLED_FROM { evidence.n_labels() } else { evidence.n_orders };
            let shares = self.softmax.share(&self.supports, n_labels, sharpness);
            for (piece, belief) in self.beliefs.iter_mut().enumerate() {
                for label in 0..n_labels {
                    belief.0[label] = 0.5 * (belief.0[label] + shares[label * width + piece]);
                }
                for label in n_labels..evidence.n_labels() {
                    belief.0[label] *= 0.5;
                }
            }
        }
        labels.clear();
        for belief in &self.beliefs {
            labels.push(belief.largest(evidence.n_labels()));
        }
    }

    #[inline(always)]
    fn add_up(&mut self, n_orders: usize) {
        for (belief, [up_to, from]) in self.beliefs.iter().zip(&mut self.up_to_and_from) {
            let (mut below, mut above) = (0.0, 0.0);
            for i in 0..n_orders.min(N) {
                let from_above = n_orders - 1 - i;
                below += belief.0[i];
                above += belief.0[from_above];
                up_to.0[i] = below;
                from.0[from_above] = above;
            }
        }
    }

    /// What speaks for the labels of every piece, given what the others believe.
    #[inline(always)]
    fn ask(&mut self, evidence: &Evidence<N>) {
        self.supports.clear();
        for piece in 0..self.beliefs.len() {
            let mut support = Lanes::splat(0.0);
            for bond in evidence.neighbours.bonds.of(piece) {
                support = support.plus(bond.weight, &self.beliefs[bond.piece]);
            }
            for rank in evidence.neighbours.ranks.of(piece) {
                let theirs = &self.up_to_and_from[rank.piece][usize::from(rank.is_above)];
                support = support.minus(rank.cost, theirs);
            }
            let all = evidence.single[piece].and(&support);
            self.supports.push(Lanes::splat(0.0).plus(self.by_size[piece], &all).0);
        }
    }
}
