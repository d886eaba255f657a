//! Order of the lines across the image: within a scan column (row) orders increase across.

use std::collections::BTreeMap;

use super::evidence::Evidence;
use super::hypotheses::Samples;
use super::pieces::Piece;
use crate::params::RANK_COST;

/// Charges every pair of labels that would stand in the wrong order, per sample they share.
///
/// Lines of solid parts cannot change places: where the nearer surface throws order k beyond order k + 1's line
/// on the ground, it also shades that line. Thin overhanging parts can; they are overruled or left unlabelled.
pub fn add_ranks(evidence: &mut Evidence, samples: &Samples, pieces: &[Piece]) {
    let mut columns: BTreeMap<(usize, i64), Vec<usize>> = BTreeMap::new();
    for (idx, sample) in samples.all.iter().enumerate() {
        columns.entry((pieces[sample.piece].frame, sample.along)).or_default().push(idx);
    }
    let mut shared: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for column in columns.values() {
        for &upper in column {
            for &lower in column {
                let (a, b) = (&samples.all[upper], &samples.all[lower]);
                if a.piece != b.piece && a.across_px < b.across_px {
                    let share = super::sample_weight(&pieces[a.piece]).min(super::sample_weight(&pieces[b.piece]));
                    *shared.entry((a.piece, b.piece)).or_default() += share;
                }
            }
        }
    }
    let n_orders = evidence.none();
    for ((upper, lower), share) in shared {
        for upper_label in 0..n_orders {
            for lower_label in 0..=upper_label {
                evidence.add_pair((upper, upper_label), (lower, lower_label), -RANK_COST * share);
            }
        }
    }
}
