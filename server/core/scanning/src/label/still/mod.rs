//! The labels of one frame by itself, in memory that is kept from frame to frame.
//!
//! The same questions in the same sequence as [`super::label_frames`] asks of a scan with one frame, which stays the
//! reference: there is no second look and no next frame, every piece is a sheet of its own, and of the samples only
//! counts matter. What is left fits into lists of numbers, all labels of a piece in one register, and no thread has to
//! be asked for help. Every decision compares the same sums of the same numbers, but for the last bits of the beliefs.

#![allow(
    clippy::needless_range_loop,
    reason = "several arrays side by side, lane by lane, is what compilers turn into vectors"
)]

mod beliefs;
mod bounds;
mod cutter;
mod evidence;
mod lanes;
mod lines;
mod neighbours;
mod places;
mod rivals;
mod settle;
mod smooth;
mod softmax;
mod waiting;

use multiversion::multiversion;
use optics::{DepthRangeMm, Triangulator};
use vision::Centrelines;

use super::pieces::Piece;
use super::relax::Verdict;
use cutter::Cutter;
use neighbours::Neighbours;
use places::Places;
use settle::Judge;

use lines::Lines;

/// Most labels that are calculated with in one piece of code, and in the other.
const FEW: usize = 8;
/// See [`FEW`].
const MANY: usize = 16;

/// The pieces of one frame and what was decided about each.
#[derive(Debug, Default)]
pub struct FrameLabels {
    /// The points of the frame.
    pub lines: Lines,
    /// Ordered by segment, then along the line.
    pub pieces: Vec<Piece>,
    /// One per piece.
    pub verdicts: Vec<Verdict>,
    cutter: Cutter,
    places: Places,
    neighbours: Neighbours,
    few: Judge<FEW>,
    many: Judge<MANY>,
    before: Vec<Verdict>,
}

/// Whether a station has few enough orders for this way.
pub fn fits(n_orders: usize) -> bool {
    n_orders < MANY
}

impl FrameLabels {
    /// Labels a frame of a station that [`fits`].
    pub fn find(&mut self, centrelines: &Centrelines, triangulator: &Triangulator, depth_range_mm: DepthRangeMm) {
        let n_orders = triangulator.calibration().orders.len();
        let Self { lines, pieces, cutter, places, neighbours, verdicts, .. } = self;
        // Compiled for every machine: where vectors are wide, points in lists of other numbers would be gathered, slowly.
        lines.take(centrelines);
        cut(lines, centrelines.correlation_px, cutter, pieces);
        if n_orders == 1 {
            // As for whole scans: nothing can contradict the only line there is.
            verdicts.clear();
            verdicts.resize(pieces.len(), Verdict::Order(0));
            return;
        }
        places.look(lines, pieces, triangulator, depth_range_mm);
        let pitch_px = |piece| places.pitch_px(piece, triangulator, lines.direction);
        neighbours.find(lines, pieces, places, pitch_px);
        if n_orders < FEW {
            decide_few(&mut self.few, places, pieces, n_orders, neighbours, verdicts);
        } else {
            decide_many(&mut self.many, places, pieces, n_orders, neighbours, verdicts);
        }
        self.before.clone_from(verdicts);
        super::doubt_stubs(pieces, verdicts, &self.before, &neighbours.joined);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn cut(lines: &Lines, correlation_px: f64, cutter: &mut Cutter, pieces: &mut Vec<Piece>) {
    cutter.cut(lines, correlation_px, pieces);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn decide_few(
    judge: &mut Judge<FEW>,
    places: &Places,
    pieces: &[Piece],
    n_orders: usize,
    neighbours: &Neighbours,
    verdicts: &mut Vec<Verdict>,
) {
    judge.decide(places, pieces, n_orders, neighbours, verdicts);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn decide_many(
    judge: &mut Judge<MANY>,
    places: &Places,
    pieces: &[Piece],
    n_orders: usize,
    neighbours: &Neighbours,
    verdicts: &mut Vec<Verdict>,
) {
    judge.decide(places, pieces, n_orders, neighbours, verdicts);
}

#[cfg(test)]
mod tests;
