//! Every sample triangulated with every label it could have.

use nalgebra::{Vector2, Vector3};
use optics::{Calibration, DepthRangeMm};
use rayon::prelude::*;
use vision::{Centrelines, LineDirection};

use super::pieces::{Piece, along_across};

/// A sample taken for one order: where it would lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// Position in the part frame.
    pub in_part_mm: Vector3<f64>,
    /// Standard deviation of the depth from image noise.
    pub sigma_mm: f64,
}

/// A sample of a piece.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Index of the piece.
    pub piece: usize,
    /// Scan column (row).
    pub along: i64,
    /// Position across the lines, px.
    pub across_px: f64,
    /// Distance to the neighbouring order's line in the image at this depth, px.
    pub pitch_px: f64,
    /// Per order (index into the calibration's list): the hypothesis, `None` if the ray misses or the depth is out of range.
    pub by_order: Vec<Option<Hypothesis>>,
}

/// The samples of all pieces, grouped by piece.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// All samples, by piece, then along the line.
    pub all: Vec<Sample>,
    /// Per piece: index of its first sample; one more entry than pieces.
    pub first_of_piece: Vec<usize>,
}

impl Samples {
    /// The samples of one piece.
    pub fn of_piece(&self, piece: usize) -> &[Sample] {
        &self.all[self.range(piece)]
    }

    /// Index of the sample of `piece` (index `idx`) in column (row) `along`, if it was sampled there.
    pub fn at(&self, idx: usize, piece: &Piece, along: i64) -> Option<usize> {
        let range = self.range(idx);
        let steps = along - self.all.get(range.start)?.along;
        let stride = piece.stride as i64;
        let place = range.start + usize::try_from(steps / stride).ok()?;
        (steps >= 0 && steps % stride == 0 && range.contains(&place)).then_some(place)
    }

    /// Their indices.
    pub fn range(&self, piece: usize) -> std::ops::Range<usize> {
        self.first_of_piece[piece]..self.first_of_piece[piece + 1]
    }
}

/// What turns a pixel into hypotheses.
pub struct View<'a> {
    /// The station.
    pub calibration: &'a Calibration,
    /// Depths the labels may lead to.
    pub depth_range_mm: DepthRangeMm,
    /// Which way the lines run.
    pub direction: LineDirection,
}

impl View<'_> {
    /// Triangulates the samples of all pieces; `shifts_mm[frame]` takes camera points to the part.
    pub fn samples(&self, frames: &[&Centrelines], shifts_mm: &[Vector3<f64>], pieces: &[Piece]) -> Samples {
        let per_piece: Vec<Vec<Sample>> = pieces
            .par_iter()
            .enumerate()
            .map(|(idx, piece)| self.samples_of(idx, piece, frames[piece.frame], &shifts_mm[piece.frame]))
            .collect();
        let mut samples = Samples { all: Vec::new(), first_of_piece: vec![0] };
        for piece in per_piece {
            samples.all.extend(piece);
            samples.first_of_piece.push(samples.all.len());
        }
        samples
    }

    fn samples_of(&self, idx: usize, piece: &Piece, lines: &Centrelines, shift_mm: &Vector3<f64>) -> Vec<Sample> {
        let mut guesses = vec![None; self.calibration.orders.len()];
        let along = piece.samples();
        along.filter_map(|along| self.sample(idx, piece, along, lines, shift_mm, &mut guesses)).collect()
    }

    fn sample(
        &self,
        idx: usize,
        piece: &Piece,
        along: i64,
        lines: &Centrelines,
        shift_mm: &Vector3<f64>,
        guesses: &mut [Option<f64>],
    ) -> Option<Sample> {
        let point = piece.point_at(lines, along)?;
        let pixel = Vector2::new(point.u_px, point.v_px);
        let mut by_order = Vec::with_capacity(guesses.len());
        let mut depths = Vec::with_capacity(guesses.len());
        for (order, guess) in self.calibration.orders.iter().zip(guesses.iter_mut()) {
            let hit = self.calibration.triangulate(*order, &pixel, *guess);
            *guess = hit.map(|hit| hit.hit.phi_rad);
            let across = match self.direction {
                LineDirection::Rows => 1,
                LineDirection::Columns => 0,
            };
            depths.push(hit.map(|hit| (hit.hit.depth_mm, hit.reach_by_pixel[across])));
            by_order.push(hit.filter(|hit| self.depth_range_mm.contains(hit.hit.depth_mm)).map(|hit| {
                Hypothesis {
                    in_part_mm: hit.hit_in_camera.xyz - shift_mm,
                    sigma_mm: hit.noise_sigma_mm(&point.normal, point.sigma_px),
                }
            }));
        }
        let across_px = along_across(point, self.direction).1;
        Some(Sample { piece: idx, along, across_px, pitch_px: pitch_px(&depths), by_order })
    }
}

/// Distance between neighbouring lines in the image: their difference in depth over the depth per pixel.
fn pitch_px(depths: &[Option<(f64, f64)>]) -> f64 {
    let pitches = depths.windows(2).filter_map(|pair| {
        let ((near, by_px), (far, _)) = (pair[0]?, pair[1]?);
        let pitch = ((far - near) / by_px).abs();
        pitch.is_finite().then_some(pitch)
    });
    pitches.fold(f64::INFINITY, f64::min)
}
