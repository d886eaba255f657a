//! Missed surfaces: sections that would agree on one surface if they all had other labels.
//!
//! The top of a part one wrap high, crossed by lines of two orders, lies on the ground under the labels next to
//! the true ones. No single section improves the score by changing its label, because its neighbours support it;
//! so sections that agree with each other are changed together.

use std::collections::BTreeMap;

use super::conditional_modes::ConditionalModes;
use crate::label::gather::evidence::Evidence;
use crate::label::union_find::UnionFind;
use crate::params::{OVERLOOKED_PER_SAMPLE, OVERLOOKED_ROUNDS};

/// `labels` with every missed surface adopted that improves the total score.
pub fn with_overlooked_surfaces(evidence: &Evidence, mut labels: Vec<usize>) -> Vec<usize> {
    let mut modes = ConditionalModes::new(evidence);
    for _ in 0..OVERLOOKED_ROUNDS {
        let mut is_better = false;
        for surface in overlooked_surfaces(evidence, &labels) {
            is_better |= adopt_if_better(evidence, &mut modes, &mut labels, &surface);
        }
        if !is_better {
            break;
        }
    }
    labels
}

/// Sections with the labels under which they observe one surface.
type Surface = Vec<(usize, usize)>;

/// Groups of repeated observations that agree with each other under labels the sections do not have.
fn overlooked_surfaces(evidence: &Evidence, labels: &[usize]) -> Vec<Surface> {
    let n = evidence.n_labels;
    let is_other = |piece: usize, label: usize| label != labels[piece] && label != evidence.none();
    let agreement = |slot: usize| -> f64 {
        let seen = evidence.observations_under(slot / n, slot % n).iter();
        seen.map(|seen| f64::from(seen.weight.max(0.0))).sum()
    };
    let is_observed = |slot: usize| {
        let (piece, label) = (slot / n, slot % n);
        is_other(piece, label) && agreement(slot) >= OVERLOOKED_PER_SAMPLE * evidence.sizes[piece]
    };
    let observed: Vec<bool> = (0..labels.len() * n).map(is_observed).collect();
    let mut unions = UnionFind::new(observed.len());
    for slot in (0..observed.len()).filter(|&slot| observed[slot]) {
        let supporting = evidence.terms_under(slot / n, slot % n).filter(|(.., weight)| *weight > 0.0);
        for (piece, label, _) in supporting {
            let other = piece * n + label;
            if observed[other] {
                unions.join(slot, other);
            }
        }
    }
    let mut surfaces: BTreeMap<usize, Surface> = BTreeMap::new();
    for slot in (0..observed.len()).filter(|&slot| observed[slot]) {
        surfaces.entry(unions.first_of(slot)).or_default().push((slot / n, slot % n));
    }
    surfaces.into_values().collect()
}

/// Adopts the surface if the total score improves once its surroundings have adapted; otherwise nothing changes.
fn adopt_if_better(
    evidence: &Evidence,
    modes: &mut ConditionalModes,
    labels: &mut Vec<usize>,
    surface: &[(usize, usize)],
) -> bool {
    let mut tried = labels.clone();
    let mut near: Vec<usize> = Vec::new();
    for &(piece, label) in surface {
        tried[piece] = label;
        near.push(piece);
        near.extend(neighbours(evidence, piece));
    }
    near.sort_unstable();
    near.dedup();
    modes.improve(&mut tried, &near);
    let mut affected: Vec<usize> = Vec::new();
    for &piece in near.iter().filter(|&&piece| tried[piece] != labels[piece]) {
        affected.push(piece);
        affected.extend(neighbours(evidence, piece));
    }
    affected.sort_unstable();
    affected.dedup();
    let total = |labels: &[usize]| -> f64 {
        affected.iter().map(|&piece| evidence.score(piece, labels[piece], labels) * evidence.sizes[piece]).sum()
    };
    let is_better = total(&tried) > total(labels) + 1e-9;
    if is_better {
        *labels = tried;
    }
    is_better
}

/// The pieces on whose labels the score of a piece depends. With observations in one direction only, these are not all
/// of [`Evidence::dependents`].
fn neighbours(evidence: &Evidence, piece: usize) -> impl Iterator<Item = usize> {
    let bonds = evidence.bonds[piece].iter().map(|bond| bond.piece);
    let seen = evidence.observations(piece).iter().map(|seen| seen.piece);
    let ranks = evidence.ranks[piece].iter().map(|rank| rank.piece);
    bonds.chain(seen).chain(ranks).map(|piece| piece as usize)
}
