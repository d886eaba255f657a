//! The pieces that cross a scan column (row) of a frame, and their positions.

use vision::{Centrelines, LineDirection};

use super::pieces::Piece;
use crate::params::SAMPLE_STRIDE_PX;

/// The pieces of a frame by scan column (row).
pub struct Columns<'a> {
    /// The pieces of all frames, ordered by frame.
    pub pieces: &'a [Piece],
    /// Those of this frame.
    pub own: std::ops::Range<usize>,
    lines: &'a Centrelines,
    direction: LineDirection,
    /// First block of columns (rows) with a piece.
    first_block: i64,
    /// Per block from there on: the pieces that cross it, so that only a few are tried for each column.
    of_blocks: Vec<Vec<usize>>,
}

/// Columns (rows) of a block: twice the length of a section of a piece, so that few sections are in two blocks.
const BLOCK_PX: i64 = 2 * SAMPLE_STRIDE_PX as i64;

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

impl<'a> Columns<'a> {
    /// The pieces of `frame`, whose lines are given; `pieces` are ordered by frame.
    pub fn new(pieces: &'a [Piece], frame: usize, lines: &'a Centrelines, direction: LineDirection) -> Self {
        let own = pieces_of(pieces, frame);
        let blocks =
            |piece: &Piece| piece.along.div_euclid(BLOCK_PX)..(piece.end_along() - 1).div_euclid(BLOCK_PX) + 1;
        let of_frame = pieces[own.clone()].iter().map(blocks);
        let first_block = of_frame.clone().map(|blocks| blocks.start).min().unwrap_or(0);
        let end_block = of_frame.clone().map(|blocks| blocks.end).max().unwrap_or(0);
        let mut of_blocks = vec![Vec::new(); (end_block - first_block) as usize];
        for (piece, blocks) in own.clone().zip(of_frame) {
            blocks.for_each(|block| of_blocks[(block - first_block) as usize].push(piece));
        }
        Self { pieces, own, lines, direction, first_block, of_blocks }
    }

    /// All pieces that cross column (row) `along`.
    fn crossings(&self, along: i64) -> impl Iterator<Item = Crossing> {
        let block = usize::try_from(along.div_euclid(BLOCK_PX) - self.first_block).ok();
        let near = block.and_then(|block| self.of_blocks.get(block)).map_or(&[][..], Vec::as_slice);
        near.iter().filter_map(move |&piece| {
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
