//! The samples of one frame: at how many of them an order is impossible, and how far apart lines are there.

use optics::{DepthRangeMm, Triangulator};
use vision::LineDirection;

use super::super::hypotheses::pitch_px;
use super::super::pieces::Piece;
use super::lines::Lines;

/// What samples say about every piece by itself, in memory that is kept from frame to frame.
#[derive(Debug, Default)]
pub struct Places {
    /// Per piece: size in full samples.
    pub sizes: Vec<f64>,
    /// Per piece and order: samples that miss the sheet or lie outside of the depth range.
    pub n_outside: Vec<usize>,
    u_px: Vec<f64>,
    v_px: Vec<f64>,
    /// Per piece: the end of its samples.
    ends: Vec<usize>,
    depths_mm: Vec<f64>,
}

impl Places {
    /// Looks at the samples of all pieces under every order.
    pub fn look(
        &mut self,
        lines: &Lines,
        pieces: &[Piece],
        triangulator: &Triangulator,
        depth_range_mm: DepthRangeMm,
    ) {
        self.gather(lines, pieces);
        let n_orders = triangulator.calibration().orders.len();
        self.n_outside.clear();
        self.n_outside.resize(pieces.len() * n_orders, 0);
        triangulator.depths(&self.u_px, &self.v_px, &mut self.depths_mm);
        for order in 0..n_orders {
            let depths_mm = &self.depths_mm[order * self.u_px.len()..];
            let mut start = 0;
            for (piece, &end) in self.ends.iter().enumerate() {
                let outside = depths_mm[start..end].iter().filter(|depth_mm| !depth_range_mm.contains(**depth_mm));
                self.n_outside[piece * n_orders + order] = outside.count();
                start = end;
            }
        }
    }

    fn gather(&mut self, lines: &Lines, pieces: &[Piece]) {
        let lists = [&mut self.u_px, &mut self.v_px, &mut self.sizes];
        lists.into_iter().for_each(Vec::clear);
        self.ends.clear();
        for piece in pieces {
            let start = lines.range(piece).start;
            let before = self.u_px.len();
            for along in piece.samples() {
                let idx = start + (along - piece.along) as usize;
                self.u_px.push(lines.u_px[idx]);
                self.v_px.push(lines.v_px[idx]);
            }
            let n_samples = self.u_px.len() - before;
            self.ends.push(before + n_samples);
            self.sizes.push((n_samples as f64 * super::super::sample_weight(piece)).max(f64::MIN_POSITIVE));
        }
    }

    /// Line pitch at the first sample of a piece, which has four samples at least.
    pub fn pitch_px(&self, piece: usize, triangulator: &Triangulator, direction: LineDirection) -> f64 {
        let first = self.range(piece).start;
        let (u_px, v_px) = (self.u_px[first], self.v_px[first]);
        let n_orders = triangulator.calibration().orders.len();
        pitch_px((0..n_orders).map(|order| triangulator.hit(order, u_px, v_px)), direction)
    }

    /// Positions of the samples of a piece across the lines.
    #[inline(always)]
    pub fn across(&self, piece: usize, direction: LineDirection) -> &[f64] {
        let across = match direction {
            LineDirection::Rows => &self.v_px,
            LineDirection::Columns => &self.u_px,
        };
        &across[self.range(piece)]
    }

    #[inline(always)]
    fn range(&self, piece: usize) -> std::ops::Range<usize> {
        (if piece == 0 { 0 } else { self.ends[piece - 1] })..self.ends[piece]
    }
}
