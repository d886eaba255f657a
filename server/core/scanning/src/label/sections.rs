//! Pieces of a moving scan, cut once more where their parts support different labels.
//!
//! A block exactly one wrap high continues a line without a measurable step. Every piece is therefore first split
//! into sections, one for each full sample, with only weak bonds between them; a seam is where their labels
//! differ.

use super::pieces::Piece;
use super::solve::inference::LabelOutcome;
use crate::params::{END_WIDTHS, SAMPLE_STRIDE_PX};

/// Every piece as sections centred on full samples, at positions common to all frames.
pub fn sections(pieces: &[Piece]) -> Vec<Piece> {
    pieces.iter().flat_map(sections_of).collect()
}

fn sections_of(piece: &Piece) -> impl Iterator<Item = Piece> + use<> {
    let (piece, end, length) = (*piece, piece.end_along(), SAMPLE_STRIDE_PX as i64);
    let first = (piece.along + length - 1).div_euclid(length) * length + length / 2;
    // A full sample lies beyond the last seam as well.
    let seams = (first..end - length / 2).step_by(SAMPLE_STRIDE_PX);
    let starts = std::iter::once(piece.along).chain(seams.clone());
    let ends = seams.chain(std::iter::once(end));
    starts.zip(ends).map(move |(from, to)| Piece {
        continues: from != piece.along,
        stride: piece.stride,
        ..piece.part(from, to)
    })
}

/// The labels of whole pieces, repeated for their sections.
pub fn labels_of(sections: &[Piece], of_pieces: &[usize]) -> Vec<usize> {
    let mut labels = of_pieces.iter();
    let mut label = 0;
    let of_section = |section: &Piece| {
        if !section.continues {
            label = *labels.next().expect("every piece begins with a section");
        }
        label
    };
    sections.iter().map(of_section).collect()
}

/// Sections of one piece with one label, merged.
pub fn merged(sections: &[Piece], labels: &[usize]) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    for (idx, section) in sections.iter().enumerate() {
        match pieces.last_mut() {
            Some(piece) if section.continues && labels[idx - 1] == labels[idx] => {
                *piece = piece.part(piece.along, section.end_along());
            }
            _ => pieces.push(Piece { continues: false, ..section.part(section.along, section.end_along()) }),
        }
    }
    pieces
}

/// Marks points near a seam between two pieces of different labels as doubtful: the position of the seam is known
/// no better than to a section or the smoothing length.
pub fn doubt_seams(
    pieces: &[Piece],
    outcomes: &[LabelOutcome],
    labels: &[Option<usize>],
    widths_px: &[f64],
) -> (Vec<Piece>, Vec<LabelOutcome>, Vec<Option<usize>>) {
    let margin = |before: usize, after: usize| {
        let (a, b) = (&pieces[before], &pieces[after]);
        if (a.frame, a.segment, a.end) != (b.frame, b.segment, b.first) || outcomes[before] == outcomes[after] {
            return 0;
        }
        let blur_px = END_WIDTHS * widths_px[before].max(widths_px[after]);
        (blur_px as i64).max(SAMPLE_STRIDE_PX as i64)
    };
    let (mut parts, mut part_outcomes, mut labels_of_parts) = (Vec::new(), Vec::new(), Vec::new());
    for (idx, piece) in pieces.iter().enumerate() {
        let (from, end) = (piece.along, piece.end_along());
        let start = if idx > 0 { (from + margin(idx - 1, idx)).min(end) } else { from };
        let stop = if idx + 1 < pieces.len() { (end - margin(idx, idx + 1)).max(start) } else { end };
        let near = if outcomes[idx] == LabelOutcome::Contradicted {
            LabelOutcome::Contradicted
        } else {
            LabelOutcome::Doubtful
        };
        for (from, to, outcome) in [(from, start, near), (start, stop, outcomes[idx]), (stop, end, near)] {
            if from < to {
                parts.push(piece.part(from, to));
                part_outcomes.push(outcome);
                labels_of_parts.push(labels[idx]);
            }
        }
    }
    (parts, part_outcomes, labels_of_parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line of 600 points from column 5 on.
    fn line() -> Piece {
        Piece { frame: 3, segment: 2, first: 40, end: 640, along: 5, stride: SAMPLE_STRIDE_PX, continues: false }
    }

    #[test]
    fn every_section_has_one_full_sample_and_together_they_are_the_piece() {
        for n_points in [4, 16, 17, 24, 31, 32, 33, 600] {
            let piece = line().part(5, 5 + n_points);
            let sections = sections(&[piece]);
            assert!(sections.windows(2).all(|pair| pair[0].end == pair[1].first && pair[1].continues));
            let labels = labels_of(&sections, &[4]);
            assert_eq!(merged(&sections, &labels), [piece], "{n_points} points");
            let n_samples: Vec<usize> = sections.iter().map(|section| section.samples().count()).collect();
            let whole = piece.stride == SAMPLE_STRIDE_PX;
            assert!(!whole || n_samples.iter().all(|&n| n == 1), "{n_points} points: {n_samples:?}");
        }
    }

    #[test]
    fn points_near_a_seam_between_labels_are_doubtful() {
        let sections = sections(&[line()]);
        let labels: Vec<usize> = (0..sections.len()).map(|idx| usize::from(idx >= 20)).collect();
        let pieces = merged(&sections, &labels);
        assert_eq!(pieces.iter().map(|piece| piece.along).collect::<Vec<_>>(), [5, 328]);
        let widths_px = [8.0, 10.0];
        let labels = [Some(0), Some(1)];
        let (parts, outcomes, labels) =
            doubt_seams(&pieces, &[LabelOutcome::Order(0), LabelOutcome::Order(1)], &labels, &widths_px);
        assert_eq!(parts.iter().map(|part| part.along).collect::<Vec<_>>(), [5, 306, 328, 350]);
        let doubtful = LabelOutcome::Doubtful;
        assert_eq!(outcomes, [LabelOutcome::Order(0), doubtful, doubtful, LabelOutcome::Order(1)]);
        assert_eq!(labels, [Some(0), Some(0), Some(1), Some(1)]);
        let (same, label) = ([LabelOutcome::Order(1); 2], [Some(1); 2]);
        let whole = (pieces.clone(), same.to_vec(), label.to_vec());
        assert_eq!(doubt_seams(&pieces, &same, &label, &widths_px), whole);
    }
}
