//! What speaks for and against the labels of one frame: depths, order across the image, and lines that go on.

use super::lanes::Lanes;
use super::neighbours::Neighbours;
use super::places::Places;
use crate::label::Piece;
use crate::params::{OUTSIDE_COST, SAMPLE_STRIDE_PX, UNLABELLED_COST};

/// All labels of all pieces; the sums are those of [`super::super::evidence`].
pub struct Evidence<'a, const N: usize> {
    /// Orders of the station, which are the first labels; "none" is the next.
    pub n_orders: usize,
    /// Per piece: its size in full samples.
    pub sizes: &'a [f64],
    /// Per piece: the weights of its labels by themselves.
    pub single: &'a [Lanes<N>],
    /// Who stands where.
    pub neighbours: &'a Neighbours,
    /// Per label of another piece: which labels are the same.
    pub same: [Lanes<N>; N],
    /// Per label of a piece above: which labels are in the wrong order below it.
    pub wrong_below: [Lanes<N>; N],
    /// Per label of a piece below: which labels are in the wrong order above it.
    pub wrong_above: [Lanes<N>; N],
}

/// What each label of each piece weighs by itself.
#[inline(always)]
pub fn weigh<const N: usize>(places: &Places, pieces: &[Piece], n_orders: usize, single: &mut Vec<Lanes<N>>) {
    single.clear();
    for (idx, piece) in pieces.iter().enumerate() {
        let mut weights = Lanes::splat(f64::NEG_INFINITY);
        let weight = piece.stride as f64 / SAMPLE_STRIDE_PX as f64;
        for order in 0..n_orders {
            weights.0[order] = -OUTSIDE_COST * places.n_outside[idx * n_orders + order] as f64 * weight;
        }
        weights.0[n_orders] = -UNLABELLED_COST * places.sizes[idx];
        single.push(weights);
    }
}

impl<'a, const N: usize> Evidence<'a, N> {
    /// Ready to be asked.
    #[inline(always)]
    pub fn new(n_orders: usize, sizes: &'a [f64], single: &'a [Lanes<N>], neighbours: &'a Neighbours) -> Self {
        let none = Lanes::splat(0.0);
        let (mut same, mut wrong_below, mut wrong_above) = ([none; N], [none; N], [none; N]);
        for other in 0..N {
            same[other].0[other] = 1.0;
            for label in 0..n_orders {
                if other < n_orders {
                    wrong_below[other].0[label] = f64::from(u8::from(label <= other));
                    wrong_above[other].0[label] = f64::from(u8::from(label >= other));
                }
            }
        }
        Self { n_orders, sizes, single, neighbours, same, wrong_below, wrong_above }
    }

    /// Orders and "none".
    #[inline(always)]
    pub fn n_labels(&self) -> usize {
        self.n_orders + 1
    }

    /// The label "none".
    #[inline(always)]
    pub fn none(&self) -> usize {
        self.n_orders
    }

    /// What speaks for every label of `piece` per sample, given the labels of all.
    #[inline(always)]
    pub fn supports(&self, piece: usize, labels: &[usize]) -> Lanes<N> {
        let mut sum = Lanes::splat(0.0);
        for bond in self.neighbours.bonds.of(piece) {
            sum = sum.plus(bond.weight, &self.same[labels[bond.piece]]);
        }
        let all = self.single[piece].and(&sum);
        all.minus(1.0, &self.wrong(piece, labels)).over(self.sizes[piece])
    }

    /// [`Evidence::supports`] without lines that go on.
    #[inline(always)]
    pub fn supports_beside_bonds(&self, piece: usize, labels: &[usize]) -> Lanes<N> {
        self.single[piece].minus(1.0, &self.wrong(piece, labels)).over(self.sizes[piece])
    }

    #[inline(always)]
    fn wrong(&self, piece: usize, labels: &[usize]) -> Lanes<N> {
        let mut wrong = Lanes::splat(0.0);
        for rank in self.neighbours.ranks.of(piece) {
            let table = if rank.is_above { &self.wrong_below } else { &self.wrong_above };
            wrong = wrong.plus(rank.cost, &table[labels[rank.piece]]);
        }
        wrong
    }
}
