//! Order of the lines across the image: within a scan column (row) orders increase across.

use super::evidence::Evidence;
use super::hypotheses::Sample;
use crate::label::columns::Columns;
use crate::params::RANK_COST;

/// Number of samples that two pieces of one frame share: upper piece, lower piece, number; ordered by piece.
pub type SharedColumns = Vec<(usize, usize, f64)>;

/// The samples shared by the pieces of a frame. `samples`: those of its pieces, in their order.
pub fn shared_columns(samples: &[Sample], columns: &Columns) -> SharedColumns {
    let (first, n) = (columns.own.start, columns.own.len());
    // Per (upper, lower): their shared samples.
    let mut shared = vec![0.0; n * n];
    for sample in samples {
        let piece = &columns.pieces[sample.piece];
        for other in columns.crossings(sample.along).filter(|other| other.piece != sample.piece) {
            let (this, other, is_above) =
                (sample.piece - first, other.piece - first, other.across_px < sample.across_px);
            let pair = if is_above { other * n + this } else { this * n + other };
            // Each of the two contributes half.
            shared[pair] += 0.5 * crate::label::sample_weight(piece);
        }
    }
    let pairs = shared.into_iter().enumerate().filter(|(_, share)| *share > 0.0);
    pairs.map(|(pair, share)| (first + pair / n, first + pair % n, share)).collect()
}

/// Adds a cost to every pair of labels in the wrong order, per shared sample.
///
/// Lines on solid parts cannot exchange ranks: where the nearer surface displaces the line of order k beyond that
/// of order k + 1 on the ground, it also shadows that line. On thin overhanging parts they can; repeated
/// observations then decide, or those lines are left unlabelled.
pub fn add_ranks(evidence: &mut Evidence, shared: &SharedColumns) {
    for &(upper, lower, share) in shared {
        evidence.add_rank(upper, lower, RANK_COST * share);
    }
}
