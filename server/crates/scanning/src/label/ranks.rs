//! Order of the lines across the image: within a scan column (row) orders increase across.

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
    let mut shared = Vec::new();
    let n_frames = pieces.last().map_or(0, |piece| piece.frame + 1);
    for frame in 0..n_frames {
        let of_frame = columns.pieces_of(frame);
        let (first, n) = (of_frame.start, of_frame.len());
        // Per (upper, lower): the samples they share.
        shared.clear();
        shared.resize(n * n, 0.0);
        for sample in &samples.all[samples.range_of(of_frame)] {
            let piece = &pieces[sample.piece];
            for other in columns.crossings(frame, sample.along).filter(|other| other.piece != sample.piece) {
                let (this, other, is_above) =
                    (sample.piece - first, other.piece - first, other.across_px < sample.across_px);
                let pair = if is_above { other * n + this } else { this * n + other };
                // Each of the two brings half of what they share.
                shared[pair] += 0.5 * super::sample_weight(piece);
            }
        }
        for (pair, share) in shared.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            evidence.add_rank(first + pair / n, first + pair % n, RANK_COST * share);
        }
    }
}
