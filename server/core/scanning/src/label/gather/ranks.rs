//! Order of the lines across the image: within a scan column (row) orders increase across.

use super::evidence::Evidence;
use super::hypotheses::Sample;
use crate::label::columns::Columns;
use crate::params::RANK_COST;

/// How many samples two pieces of one frame share: upper piece, lower piece, their number; ordered by piece.
pub type SharedColumns = Vec<(usize, usize, f64)>;

/// What the pieces of a frame share. `samples`: those of its pieces, in their order.
pub fn shared_columns(samples: &[Sample], columns: &Columns) -> SharedColumns {
    let (first, n) = (columns.own.start, columns.own.len());
    // Per (upper, lower): the samples they share.
    let mut shared = vec![0.0; n * n];
    for sample in samples {
        let piece = &columns.pieces[sample.piece];
        for other in columns.crossings(sample.along).filter(|other| other.piece != sample.piece) {
            let (this, other, is_above) =
                (sample.piece - first, other.piece - first, other.across_px < sample.across_px);
            let pair = if is_above { other * n + this } else { this * n + other };
            // Each of the two brings half of what they share.
            shared[pair] += 0.5 * crate::label::sample_weight(piece);
        }
    }
    let pairs = shared.into_iter().enumerate().filter(|(_, share)| *share > 0.0);
    pairs.map(|(pair, share)| (first + pair / n, first + pair % n, share)).collect()
}

/// Charges every pair of labels that would stand in the wrong order, per sample they share.
///
/// Lines of solid parts cannot change places: where the nearer surface throws order k beyond order k + 1's line
/// on the ground, it also shades that line. Thin overhanging parts can; they are overruled or left unlabelled.
pub fn add_ranks(evidence: &mut Evidence, shared: &SharedColumns) {
    for &(upper, lower, share) in shared {
        evidence.add_rank(upper, lower, RANK_COST * share);
    }
}
