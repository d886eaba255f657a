//! Order of the lines across the image: within a scan column (row) orders increase across.

use std::collections::BTreeMap;

use super::columns::Columns;
use super::evidence::Evidence;
use super::hypotheses::Samples;
use super::pieces::Piece;
use crate::params::RANK_COST;

/// Charges every pair of labels that would stand in the wrong order, per sample they share.
///
/// Lines of solid parts cannot change places: where the nearer surface throws order k beyond order k + 1's line
/// on the ground, it also shades that line. Thin overhanging parts can; they are overruled or left unlabelled.
pub fn add_ranks(evidence: &mut Evidence, samples: &Samples, pieces: &[Piece], columns: &Columns) {
    let mut shared: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for sample in &samples.all {
        let piece = &pieces[sample.piece];
        for other in columns.crossings(piece.frame, sample.along).filter(|other| other.piece != sample.piece) {
            let above = other.across_px < sample.across_px;
            let pair = if above { (other.piece, sample.piece) } else { (sample.piece, other.piece) };
            // Each of the two brings half of what they share.
            *shared.entry(pair).or_default() += 0.5 * super::sample_weight(piece);
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
