//! Parts of lines that were cut out: restored where both sides have the same label, otherwise candidates for
//! reinstatement.

use vision::Centrelines;

use super::Labels;
use super::columns::pieces_of;
use super::pieces::Piece;
use super::solve::inference::LabelOutcome;

/// Extends a piece to the next one of the same segment and label: the line was not a joint of two lines at the cut
/// between them.
pub fn close(pieces: &mut [Piece], outcomes: &[LabelOutcome]) {
    for idx in 1..pieces.len() {
        let (a, b) = (pieces[idx - 1], pieces[idx]);
        let is_one_line = (a.frame, a.segment) == (b.frame, b.segment);
        if is_one_line && outcomes[idx - 1] == outcomes[idx] && matches!(outcomes[idx], LabelOutcome::Order(_)) {
            pieces[idx - 1] = a.part(a.along, b.along);
        }
    }
}

impl Labels {
    /// The pieces of a frame without a certain label.
    pub fn uncertain_pieces(&self, frame: usize) -> impl Iterator<Item = &Piece> {
        let own = pieces_of(&self.pieces, frame);
        let is_uncertain = |idx: &usize| !matches!(self.outcomes[*idx], LabelOutcome::Order(_));
        own.filter(is_uncertain).map(|idx| &self.pieces[idx])
    }

    /// The parts of a frame's lines that were rejected and could still have a label: its doubtful pieces, the
    /// parts cut out between two pieces of one label, and the ends of segments.
    pub fn candidates(&self, frame: usize, lines: &Centrelines) -> Self {
        let own = pieces_of(&self.pieces, frame);
        let mut candidates = Self {
            pieces: Vec::new(),
            outcomes: Vec::new(),
            labels: Vec::new(),
            direction: self.direction,
            crossing: self.crossing,
            line_width_px: self.line_width_px,
            are_certain: self.are_certain,
        };
        for idx in own.clone() {
            let (piece, label) = (self.pieces[idx], self.labels[idx]);
            let follows = |other: usize| own.contains(&other) && self.pieces[other].segment == piece.segment;
            if !idx.checked_sub(1).is_some_and(follows) {
                candidates.add(piece.part(piece.along - piece.first as i64, piece.along), label);
            }
            if self.outcomes[idx] == LabelOutcome::Doubtful {
                candidates.add(piece, label);
            }
            let n_left = lines.segments[piece.segment].points.len() - piece.end;
            let (until, label) = match follows(idx + 1) {
                true => (self.pieces[idx + 1].along, label.filter(|_| self.labels[idx + 1] == label)),
                false => (piece.end_along() + n_left as i64, label),
            };
            candidates.add(piece.part(piece.end_along(), until), label);
        }
        candidates
    }

    fn add(&mut self, piece: Piece, label: Option<usize>) {
        if let Some(order_idx) = label.filter(|_| piece.n_points() > 0) {
            self.pieces.push(piece);
            self.outcomes.push(LabelOutcome::Order(order_idx));
            self.labels.push(label);
        }
    }
}

#[cfg(test)]
mod tests {
    use vision::{CentrelinePoint, LineDirection, Segment};

    use super::*;

    /// The piece of points `first` to before `end` of the second segment in frame 1, which begins in column 100.
    fn piece(first: usize, end: usize) -> Piece {
        let along = 100 + first as i64;
        Piece { frame: 1, segment: 1, first, end, along, stride: 1, continues: false }
            .part(along, 100 + end as i64)
    }

    #[test]
    fn a_cut_between_two_pieces_of_one_label_is_closed() {
        let cut = [piece(0, 30), piece(34, 60), piece(64, 90), piece(94, 120)];
        let (one, other) = (LabelOutcome::Order(2), LabelOutcome::Order(3));
        let mut pieces = cut;
        close(&mut pieces, &[one, one, other, LabelOutcome::Doubtful]);
        assert_eq!(pieces, [piece(0, 34), cut[1], cut[2], cut[3]]);
        let mut doubtful = cut;
        close(&mut doubtful, &[LabelOutcome::Doubtful; 4]);
        assert_eq!(doubtful, cut);
    }

    #[test]
    fn candidates_keep_the_label_they_could_have() {
        let segment = |n_points| Segment { points: vec![CentrelinePoint::UNWRITTEN; n_points] };
        let lines = Centrelines { segments: vec![segment(9), segment(130)], ..Centrelines::default() };
        let labels = Labels {
            pieces: vec![piece(5, 30), piece(34, 60), piece(64, 90), piece(94, 120)],
            outcomes: vec![
                LabelOutcome::Order(2),
                LabelOutcome::Doubtful,
                LabelOutcome::Order(3),
                LabelOutcome::Contradicted,
            ],
            labels: vec![Some(2), Some(2), Some(3), None],
            direction: LineDirection::Rows,
            crossing: None,
            line_width_px: 5.0,
            are_certain: false,
        };
        let candidates = labels.candidates(1, &lines);
        assert_eq!(candidates.pieces, [piece(0, 5), piece(30, 34), piece(34, 60)]);
        assert_eq!(candidates.labels, [Some(2); 3]);
        assert!(labels.candidates(0, &lines).pieces.is_empty());
    }
}
