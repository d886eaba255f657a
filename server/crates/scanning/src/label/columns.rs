//! Which pieces cross a scan column (row) of a frame, and where.

use vision::{Centrelines, LineDirection};

use super::pieces::{Piece, along_across};

/// The pieces of all frames, ready to be asked column by column.
pub struct Columns<'a> {
    pieces: &'a [Piece],
    frames: &'a [&'a Centrelines],
    direction: LineDirection,
    /// Per frame: index of its first piece; one more entry than frames.
    first_of_frame: Vec<usize>,
}

/// A piece where it crosses a column (row).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Index of the piece.
    pub piece: usize,
    /// Position across the lines, px.
    pub across_px: f64,
}

impl<'a> Columns<'a> {
    /// `pieces` are ordered by frame.
    pub fn new(pieces: &'a [Piece], frames: &'a [&'a Centrelines], direction: LineDirection) -> Self {
        let first_of_frame =
            (0..=frames.len()).map(|frame| pieces.partition_point(|piece| piece.frame < frame)).collect();
        Self { pieces, frames, direction, first_of_frame }
    }

    /// Indices of the pieces of a frame.
    pub fn pieces_of(&self, frame: usize) -> std::ops::Range<usize> {
        self.first_of_frame[frame]..self.first_of_frame[frame + 1]
    }

    /// All pieces that cross column (row) `along` of `frame`.
    pub fn crossings(&self, frame: usize, along: i64) -> impl Iterator<Item = Crossing> {
        let lines = self.frames[frame];
        self.pieces_of(frame).filter_map(move |piece| {
            let point = self.pieces[piece].point_at(lines, along)?;
            Some(Crossing { piece, across_px: along_across(point, self.direction).1 })
        })
    }

    /// The crossing nearest to `across_px`, if within `gate_px`.
    pub fn nearest(&self, frame: usize, along: i64, across_px: f64, gate_px: f64) -> Option<Crossing> {
        let miss = |crossing: &Crossing| (crossing.across_px - across_px).abs();
        let nearest = self.crossings(frame, along).min_by(|a, b| miss(a).total_cmp(&miss(b)))?;
        (miss(&nearest) <= gate_px).then_some(nearest)
    }
}
