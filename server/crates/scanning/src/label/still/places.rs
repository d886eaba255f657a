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
    /// Per piece: line pitch at its first sample.
    pub pitches_px: Vec<f64>,
    /// Per piece and order: samples that miss the sheet or lie outside of the depth range.
    pub n_outside: Vec<usize>,
    u_px: Vec<f64>,
    v_px: Vec<f64>,
    /// Per piece: the end of its samples.
    ends: Vec<usize>,
    depths_mm: Vec<f64>,
    first_u_px: Vec<f64>,
    first_v_px: Vec<f64>,
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
        self.measure_pitches(triangulator, lines.direction);
    }

    fn gather(&mut self, lines: &Lines, pieces: &[Piece]) {
        let lists = [&mut self.u_px, &mut self.v_px, &mut self.first_u_px, &mut self.first_v_px, &mut self.sizes];
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
            // A piece has four samples at least.
            self.first_u_px.push(self.u_px[before]);
            self.first_v_px.push(self.v_px[before]);
        }
    }

    fn measure_pitches(&mut self, triangulator: &Triangulator, direction: LineDirection) {
        let n_orders = triangulator.calibration().orders.len();
        self.pitches_px.clear();
        for (u_px, v_px) in self.first_u_px.iter().zip(&self.first_v_px) {
            let by_order = (0..n_orders).map(|order| triangulator.hit(order, *u_px, *v_px));
            self.pitches_px.push(pitch_px(by_order, direction));
        }
    }
}
