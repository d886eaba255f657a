//! From evidence to the labels of one frame, step by step as [`super::super::relax`] does it for whole scans.

use super::super::relax::Verdict;
use super::super::unions::Unions;
use super::beliefs::Beliefs;
use super::evidence::Evidence;
use super::lanes::Lanes;
use super::neighbours::Neighbours;
use super::places::Places;
use super::rivals::Rivals;
use crate::label::Piece;
use crate::params::{GROUP_MARGIN, LABEL_MARGIN, OVERRULED_MARGIN, SETTLE_SWEEPS};

/// Decides, in memory that is kept from frame to frame.
#[derive(Debug, Default)]
pub struct Judge<const N: usize> {
    single: Vec<Lanes<N>>,
    beliefs: Beliefs<N>,
    labels: Vec<usize>,
    doubtful: Vec<bool>,
    groups: Groups,
    rivals: Rivals<N>,
}

impl<const N: usize> Judge<N> {
    /// The verdict on every piece.
    #[inline(always)]
    pub fn decide(
        &mut self,
        places: &Places,
        pieces: &[Piece],
        n_orders: usize,
        neighbours: &Neighbours,
        verdicts: &mut Vec<Verdict>,
    ) {
        super::evidence::weigh(places, pieces, n_orders, &mut self.single);
        let evidence = Evidence::new(n_orders, &places.sizes, &self.single, neighbours);
        self.beliefs.relax(&evidence, &mut self.labels);
        let labels = &mut self.labels;
        improve_all(&evidence, labels);
        self.doubtful.clear();
        self.doubtful.resize(pieces.len(), false);
        self.groups.find(&evidence, labels);
        for group in 0..self.groups.n_groups() {
            self.groups.challenge(&evidence, group, labels, &mut self.doubtful);
        }
        self.rivals.prepare(&evidence, labels);
        verdicts.clear();
        for piece in 0..pieces.len() {
            let label = labels[piece];
            verdicts.push(if label == evidence.none() {
                Verdict::Contradicted
            } else if self.doubtful[piece]
                || evidence.supports(piece, labels).margin(label, n_orders) < LABEL_MARGIN
                || evidence.supports_beside_bonds(piece, labels).margin(label, n_orders) < -OVERRULED_MARGIN
                || self.rivals.has_rival(&evidence, piece)
            {
                Verdict::Doubtful
            } else {
                Verdict::Order(label)
            });
        }
    }
}

/// Takes the best label for one piece after the other until nothing changes.
#[inline(always)]
fn improve_all<const N: usize>(evidence: &Evidence<N>, labels: &mut [usize]) {
    for _ in 0..SETTLE_SWEEPS {
        let mut changed = false;
        for piece in 0..labels.len() {
            changed |= improve(evidence, labels, piece);
        }
        if !changed {
            break;
        }
    }
}

#[inline(always)]
fn improve<const N: usize>(evidence: &Evidence<N>, labels: &mut [usize], piece: usize) -> bool {
    let best = evidence.supports(piece, labels).largest(evidence.n_labels());
    let changed = best != labels[piece];
    labels[piece] = best;
    changed
}

/// Pieces that speak for each other's labels: none of them alone would admit to a common error.
#[derive(Debug, Default)]
struct Groups {
    unions: Unions,
    /// Members of all groups, one group after the other, and where each ends.
    members: Vec<usize>,
    ends: Vec<usize>,
    /// Labels of the members of a group: as found, and the best answer.
    kept: Vec<usize>,
    best: Vec<usize>,
}

impl Groups {
    #[inline(always)]
    fn find<const N: usize>(&mut self, evidence: &Evidence<N>, labels: &[usize]) {
        self.unions.reset(labels.len());
        for piece in 0..labels.len() {
            for bond in evidence.neighbours.bonds.of(piece) {
                let other = bond.piece;
                if labels[piece] != evidence.none() && bond.weight > 0.0 && labels[other] == labels[piece] {
                    self.unions.join(piece, other);
                }
            }
        }
        self.members.clear();
        self.ends.clear();
        for first in 0..labels.len() {
            if labels[first] == evidence.none() || self.unions.first_of(first) != first {
                continue;
            }
            for piece in first..labels.len() {
                if self.unions.first_of(piece) == first {
                    self.members.push(piece);
                }
            }
            self.ends.push(self.members.len());
        }
    }

    #[inline(always)]
    fn n_groups(&self) -> usize {
        self.ends.len()
    }

    /// Shifts a group by one and more orders; a better answer is taken, one nearly as good makes the group doubtful.
    #[inline(always)]
    fn challenge<const N: usize>(
        &mut self,
        evidence: &Evidence<N>,
        group: usize,
        labels: &mut [usize],
        doubtful: &mut [bool],
    ) {
        let Self { members, ends, kept, best, .. } = self;
        let members = &members[if group == 0 { 0 } else { ends[group - 1] }..ends[group]];
        if let [alone] = members
            && evidence.supports(*alone, labels).largest(evidence.n_labels()) == labels[*alone]
        {
            // However it is shifted, it falls back to its best label.
            return;
        }
        kept.clear();
        kept.extend(members.iter().map(|&piece| labels[piece]));
        best.clone_from(kept);
        let (mut best_support, mut runner_up) = (group_support(evidence, members, labels), f64::NEG_INFINITY);
        let n_orders = evidence.n_orders as isize;
        for shift in 1 - n_orders..n_orders {
            if shift == 0 {
                continue;
            }
            for (&piece, &label) in members.iter().zip(&*kept) {
                let shifted = label as isize + shift;
                labels[piece] = if (0..n_orders).contains(&shifted) { shifted as usize } else { evidence.none() };
            }
            improve_group(evidence, members, labels);
            let same = members.iter().zip(&*kept).filter(|(piece, label)| labels[**piece] == **label).count();
            if same == members.len() || 2 * same > members.len() {
                continue;
            }
            let support = group_support(evidence, members, labels);
            if support > best_support {
                runner_up = best_support;
                best_support = support;
                best.clear();
                best.extend(members.iter().map(|&piece| labels[piece]));
            } else {
                runner_up = runner_up.max(support);
            }
        }
        for (&piece, &label) in members.iter().zip(&*best) {
            labels[piece] = label;
        }
        let size: f64 = members.iter().map(|&piece| evidence.sizes[piece]).sum();
        if best_support - runner_up < GROUP_MARGIN * size {
            members.iter().for_each(|&piece| doubtful[piece] = true);
        }
    }
}

#[inline(always)]
fn improve_group<const N: usize>(evidence: &Evidence<N>, members: &[usize], labels: &mut [usize]) {
    for _ in 0..SETTLE_SWEEPS {
        let mut changed = false;
        for &piece in members {
            changed |= improve(evidence, labels, piece);
        }
        if !changed {
            break;
        }
    }
}

#[inline(always)]
fn group_support<const N: usize>(evidence: &Evidence<N>, members: &[usize], labels: &[usize]) -> f64 {
    let mut sum = 0.0;
    for &piece in members {
        sum += evidence.supports(piece, labels).0[labels[piece]] * evidence.sizes[piece];
    }
    sum
}
