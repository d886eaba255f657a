//! Overlooked surfaces: sections that would agree on one surface if they all had other labels.
//!
//! The top of a part one wrap high, crossed by lines of two orders, lies on the ground under the labels next to the
//! true ones. No single section gains by leaving those, because its neighbours support it; so sections that agree with
//! each other are changed together.

use std::collections::BTreeMap;

use super::relax::improve;
use crate::label::gather::evidence::{Evidence, Kind};
use crate::label::union_find::UnionFind;
use crate::params::{OVERLOOKED_ROUNDS, OVERLOOKED_SHARE};

/// `labels` with every overlooked surface adopted that improves the total score.
pub fn with_overlooked_surfaces(evidence: &Evidence, mut labels: Vec<usize>) -> Vec<usize> {
    for _ in 0..OVERLOOKED_ROUNDS {
        let mut is_better = false;
        for surface in overlooked_surfaces(evidence, &labels) {
            is_better |= take(evidence, &mut labels, &surface);
        }
        if !is_better {
            break;
        }
    }
    labels
}

/// Sections with the labels under which they observe one surface.
type Surface = Vec<(usize, usize)>;

/// Groups of second looks that agree with each other under labels the sections do not have.
fn overlooked_surfaces(evidence: &Evidence, labels: &[usize]) -> Vec<Surface> {
    let n = evidence.n_labels;
    let is_other = |piece: usize, label: usize| label != labels[piece] && label != evidence.none();
    let agreement = |slot: usize| -> f64 {
        let features =
            evidence.pairs[slot].iter().filter(|pair| pair.kind == Kind::SecondLook && pair.weight > 0.0);
        features.map(|pair| f64::from(pair.weight)).sum()
    };
    let is_seen = |slot: usize| {
        let (piece, label) = (slot / n, slot % n);
        is_other(piece, label) && agreement(slot) >= OVERLOOKED_SHARE * evidence.sizes[piece]
    };
    let seen: Vec<bool> = (0..labels.len() * n).map(is_seen).collect();
    let mut unions = UnionFind::new(seen.len());
    for slot in (0..seen.len()).filter(|&slot| seen[slot]) {
        for pair in evidence.pairs[slot].iter().filter(|pair| pair.weight > 0.0) {
            let other = pair.piece as usize * n + pair.label as usize;
            if seen[other] {
                unions.join(slot, other);
            }
        }
    }
    let mut surfaces: BTreeMap<usize, Surface> = BTreeMap::new();
    for slot in (0..seen.len()).filter(|&slot| seen[slot]) {
        surfaces.entry(unions.first_of(slot)).or_default().push((slot / n, slot % n));
    }
    surfaces.into_values().collect()
}

/// Adopts the surface if the total score improves once its surroundings have adapted; otherwise nothing changes.
fn take(evidence: &Evidence, labels: &mut Vec<usize>, surface: &[(usize, usize)]) -> bool {
    let mut tried = labels.clone();
    let mut near: Vec<usize> = Vec::new();
    for &(piece, label) in surface {
        tried[piece] = label;
        near.push(piece);
        near.extend(neighbours(evidence, piece));
    }
    near.sort_unstable();
    near.dedup();
    improve(evidence, &mut tried, &near);
    let mut touched: Vec<usize> = Vec::new();
    for &piece in near.iter().filter(|&&piece| tried[piece] != labels[piece]) {
        touched.push(piece);
        touched.extend(neighbours(evidence, piece));
    }
    touched.sort_unstable();
    touched.dedup();
    let total = |labels: &[usize]| -> f64 {
        touched.iter().map(|&piece| evidence.score(piece, labels[piece], labels) * evidence.sizes[piece]).sum()
    };
    let is_better = total(&tried) > total(labels) + 1e-9;
    if is_better {
        *labels = tried;
    }
    is_better
}

/// All pieces whose score depends on a piece's label.
fn neighbours(evidence: &Evidence, piece: usize) -> impl Iterator<Item = usize> {
    let n = evidence.n_labels;
    let pairs = evidence.pairs[piece * n..(piece + 1) * n].iter().flatten().map(|pair| pair.piece as usize);
    pairs.chain(evidence.ranks[piece].iter().map(|rank| rank.piece as usize))
}
