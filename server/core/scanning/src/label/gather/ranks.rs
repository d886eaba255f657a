//! Order of the lines across the image: within a scan column (row) orders increase across.

use vision::{Centrelines, LineDirection};

use super::evidence::Evidence;
use super::hypotheses::Samples;
use crate::label::pieces::Piece;
use crate::label::sample_weight;
use crate::params::RANK_COST;

/// Number of samples that two pieces of one frame share: upper piece, lower piece, number; ordered by piece.
pub type SharedColumns = Vec<(usize, usize, f64)>;

/// The samples shared by the pieces of a frame, which are numbered from `first_piece`.
pub fn shared_columns(
    samples: &Samples,
    pieces: &[Piece],
    first_piece: usize,
    (lines, direction): (&Centrelines, LineDirection),
) -> SharedColumns {
    let mut by_start: Vec<usize> = (0..pieces.len()).collect();
    by_start.sort_by_key(|&piece| pieces[piece].along);
    // Samples of `this` in the columns of `other`: where that lies above, and where below.
    let share = |this: usize, other: usize| {
        let (mut above, mut below) = (0.0, 0.0);
        let (other, of_this) = (&pieces[other], samples.of_piece(this));
        let first = of_this.partition_point(|sample| sample.along < other.along);
        for sample in of_this[first..].iter().take_while(|sample| sample.along < other.end_along()) {
            let there = &other.points(lines)[(sample.along - other.along) as usize];
            let is_above = there.along_across(direction).1 < sample.across_px;
            // Each of the two contributes half.
            *(if is_above { &mut above } else { &mut below }) += 0.5 * sample_weight(&pieces[this]);
        }
        (above, below)
    };
    let mut shared = SharedColumns::new();
    for (place, &this) in by_start.iter().enumerate() {
        let overlapping =
            by_start[place + 1..].iter().take_while(|&&other| pieces[other].along < pieces[this].end_along());
        for &other in overlapping {
            let ((other_above, other_below), (this_above, this_below)) = (share(this, other), share(other, this));
            let (this, other) = (first_piece + this, first_piece + other);
            shared.push((other, this, other_above + this_below));
            shared.push((this, other, other_below + this_above));
        }
    }
    shared.retain(|(_, _, share)| *share > 0.0);
    shared.sort_unstable_by_key(|(upper, lower, _)| (*upper, *lower));
    shared
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
