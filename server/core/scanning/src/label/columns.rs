//! The pieces that cross a scan column (row) of a frame, and their positions.

use vision::{Centrelines, LineDirection};

use super::pieces::Piece;

/// The pieces of a frame by scan column (row).
pub struct Columns<'a> {
    /// The pieces of all frames, ordered by frame.
    pub pieces: &'a [Piece],
    /// Those of this frame.
    pub own: std::ops::Range<usize>,
    /// The lines of this frame.
    pub lines: &'a Centrelines,
    /// Direction of the lines.
    pub direction: LineDirection,
}

/// A piece where it crosses a column (row).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Index of the piece.
    pub piece: usize,
    /// Position across the lines, px.
    pub across_px: f64,
}

/// Indices of the pieces of a frame; `pieces` are ordered by frame.
pub fn pieces_of(pieces: &[Piece], frame: usize) -> std::ops::Range<usize> {
    pieces.partition_point(|piece| piece.frame < frame)..pieces.partition_point(|piece| piece.frame <= frame)
}

impl Columns<'_> {
    /// All pieces that cross column (row) `along`.
    pub fn crossings(&self, along: i64) -> impl Iterator<Item = Crossing> {
        self.own.clone().filter_map(move |piece| {
            let point = self.pieces[piece].point_at(self.lines, along)?;
            Some(Crossing { piece, across_px: point.along_across(self.direction).1 })
        })
    }

    /// The crossing nearest to `across_px`, if within `gate_px`.
    pub fn nearest(&self, along: i64, across_px: f64, gate_px: f64) -> Option<Crossing> {
        let miss = |crossing: &Crossing| (crossing.across_px - across_px).abs();
        let nearest = self.crossings(along).min_by(|a, b| miss(a).total_cmp(&miss(b)))?;
        (miss(&nearest) <= gate_px).then_some(nearest)
    }
}
