//! Joint shifts of lines to the next order.
//!
//! Lines constrain each other by rank and continuity, so that none of a row of lines gains by changing alone, and a
//! whole region of a scan may be off by one order.

use super::conditional_modes::ConditionalModes;
use super::inference::{all_pieces, total_score};
use super::shifts::{Change, Costs};
use crate::label::gather::evidence::{Evidence, wrong_labels};
use crate::params::SHIFT_ROUNDS;

/// Shifts the best set of pieces by one order until nothing improves.
pub fn shift_together(evidence: &Evidence, labels: &mut Vec<usize>) {
    let all_pieces = all_pieces(evidence);
    let mut modes = ConditionalModes::new(evidence);
    let mut score = total_score(evidence, labels);
    for _ in 0..SHIFT_ROUNDS {
        let before = score;
        for by in [-1, 1] {
            let mut tried = labels.clone();
            for (piece, change) in costs(evidence, labels, by).cut().best() {
                tried[piece] = match change {
                    Change::Shifted => shifted(evidence, labels[piece], by),
                    Change::Unlabelled => evidence.none(),
                };
            }
            if tried == *labels {
                continue;
            }
            modes.improve(&mut tried, &all_pieces);
            let gained = total_score(evidence, &tried);
            if gained > score {
                (*labels, score) = (tried, gained);
            }
        }
        if score == before {
            break;
        }
    }
}

/// The label that is `by` orders higher; "none" where there is no such order.
fn shifted(evidence: &Evidence, label: usize, by: isize) -> usize {
    label.checked_add_signed(by).filter(|label| *label < evidence.none()).unwrap_or(evidence.none())
}

/// Costs of shifting pieces by so many orders, or of leaving them unlabelled. Unlabelled pieces stay unlabelled.
fn costs(evidence: &Evidence, labels: &[usize], by: isize) -> Costs {
    let (n, none) = (evidence.n_labels, evidence.none());
    let mut costs = Costs::new(labels.len());
    // Per pair of pieces, the lower index first: their states and the cost.
    let mut pairs: Vec<([usize; 2], [usize; 2], f64)> = Vec::new();
    let states = |piece: usize| [labels[piece], shifted(evidence, labels[piece], by)];
    for piece in (0..labels.len()).filter(|&piece| labels[piece] != none) {
        let [label, shifted] = states(piece);
        costs.add_own(piece, [label, none, shifted].map(|label| -evidence.unary[piece * n + label]));
        for bond in evidence.bonds[piece].iter().filter(|bond| labels[bond.piece as usize] == none) {
            // Both halves of the cost: it does not depend on the other piece.
            costs.add_own(piece, [0.0, -2.0 * f64::from(bond.weight), 0.0]);
        }
        let mut add = |state: usize, other: usize, is_theirs: &dyn Fn(usize) -> bool, cost: f64| {
            for (other_state, _) in states(other).into_iter().enumerate().filter(|(_, label)| is_theirs(*label)) {
                pairs.push(if piece < other {
                    ([piece, other], [state, other_state], cost)
                } else {
                    ([other, piece], [other_state, state], cost)
                });
            }
        };
        for (state, label) in states(piece).into_iter().enumerate().filter(|(_, label)| *label != none) {
            for bond in evidence.bonds[piece].iter().filter(|bond| labels[bond.piece as usize] != none) {
                let (other, weight) = (bond.piece as usize, f64::from(bond.weight));
                if labels[other] != labels[piece] {
                    add(state, other, &|theirs| theirs == label, -weight);
                } else if state == 0 {
                    costs.add_bond(piece, other, weight);
                }
            }
            let seen = evidence.observations_under(piece, label).iter();
            for seen in seen.filter(|seen| labels[seen.piece as usize] != none) {
                let theirs = usize::from(seen.label);
                add(state, seen.piece as usize, &|label| label == theirs, -f64::from(seen.weight));
            }
            for rank in evidence.ranks[piece].iter().filter(|rank| labels[rank.piece as usize] != none) {
                let wrong = wrong_labels(rank.is_above, label, none);
                add(state, rank.piece as usize, &|theirs| wrong.contains(&theirs), f64::from(rank.cost));
            }
        }
    }
    pairs.sort_unstable_by_key(|pair| pair.0);
    for of_pair in pairs.chunk_by(|a, b| a.0 == b.0) {
        let [first, second] = of_pair[0].0;
        let mut cost = [[0.0; 2]; 2];
        of_pair.iter().for_each(|(_, [a, b], weight)| cost[*a][*b] += weight);
        costs.add_pair(first, second, cost);
    }
    costs
}
