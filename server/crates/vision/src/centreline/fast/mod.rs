//! The extraction at the speed of the camera: the whole image is read once, everything else only where light is.
//!
//! Noise from some rows → sums of small cells, which tell where lines can be → candidates there, as the reference
//! finds them → traces → every crossing straightened into a window, sixteen columns at a time, and measured by
//! derivatives across the line → averaging along the line. All arithmetic runs in lanes that do not mix and without
//! fused multiply-add, so that every instruction set gives the same bits.

#![allow(
    clippy::needless_range_loop,
    reason = "several arrays side by side, lane by lane, is what compilers turn into vectors"
)]

mod along;
mod candidates;
mod cells;
mod clearance;
mod crossings;
mod kernels;
mod lanes;
mod noise;
mod pieces;
mod taps;
mod width;
mod window;

use multiversion::multiversion;

use super::reference::candidates::{Boxes, Candidate};
use super::reference::ends::without_bent_ends;
use super::reference::scatter::{Differences, Scatter};
use super::reference::segments::Linker;
use super::view::{Level, View};
use super::{Centrelines, Segment};
use crate::params::NOISE_TILE_PX;
use along::Averager;
use candidates::Search;
use cells::{Cells, Strip};
use clearance::Columns;
use crossings::{Image, Measurer};
use noise::{BoxNoise, PixelNoise};
use pieces::{Crossings, Piece, PieceOf};
use width::Peaks;

/// Smallest side, in pixels, that is worth the trouble: smaller images go the straightforward way.
const MIN_SIDE_PX: usize = 64;

/// Most rows: their numbers are calculated with in 16 bits.
const MAX_HEIGHT_PX: usize = 1 << 14;

/// Segments kept for images with more of them: those of usual scenes, so that a picture full of noise is forgotten.
const SPARE_SEGMENTS: usize = 64;

/// Whether an image is of a size for this way.
pub fn fits(width: usize, height: usize) -> bool {
    width >= MIN_SIDE_PX && (MIN_SIDE_PX..=MAX_HEIGHT_PX).contains(&height)
}

/// The memory of an extraction, kept from image to image.
#[derive(Default)]
pub struct Memory<T: Level> {
    cells: Cells<T>,
    pixel_noise: PixelNoise<T>,
    strips: Vec<Strip>,
    peaks: Peaks,
    box_noise: BoxNoise<T>,
    search: Search<T>,
    candidates: Vec<Candidate>,
    linker: Linker,
    columns: Columns,
    measurer: Measurer<T>,
    crossings: Crossings,
    pieces: Vec<Piece>,
    differences: Differences,
    averager: Averager,
    gains: Vec<f32>,
    /// Segments beyond those of an image, with the memory of their points.
    spare: Vec<Segment>,
}

/// The lines of an image of 8 bits.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
pub fn extract_eight(view: &View<u8>, memory: &mut Memory<u8>, found: &mut Centrelines) {
    extract(view, memory, found);
}

/// The lines of an image of 16 bits.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
pub fn extract_sixteen(view: &View<u16>, memory: &mut Memory<u16>, found: &mut Centrelines) {
    extract(view, memory, found);
}

/// The lines of an image, by whatever instructions the caller was compiled for.
#[inline(always)]
pub fn extract<T: Level>(view: &View<T>, memory: &mut Memory<T>, found: &mut Centrelines) {
    let Memory { cells, pixel_noise, strips, peaks, box_noise, search, candidates, linker, .. } = memory;
    let Memory { columns, measurer, crossings, pieces, .. } = memory;
    cells.begin(view);
    pixel_noise.begin(view);
    for v0 in (0..view.height).step_by(NOISE_TILE_PX) {
        // What is read from memory here is near when its noise is measured.
        cells.sum_up(view, v0..(v0 + NOISE_TILE_PX).min(view.height));
        pixel_noise.measure(view, v0);
    }
    let pixel_noise = pixel_noise.map();
    cells.strips_with_light(view, pixel_noise, strips);
    let width_px = width::typical_width_px(view, pixel_noise, strips, peaks);
    let boxes = Boxes::for_width(width_px);
    let box_noise = box_noise.measure(view, boxes, pixel_noise, strips);
    search.candidates(view, box_noise, boxes, width_px, strips, candidates);
    let traces = linker.link(candidates, width_px);
    if clearance::are_crowded(candidates, width_px) {
        clearance::mark_clearances(traces, view.width, columns);
    }
    let image = Image::new(view, pixel_noise, boxes, width_px);
    crossings.clear();
    pieces.clear();
    for trace in &*traces {
        let start = measurer.measure(&image, trace, crossings);
        crossings.cut(trace.first_u, start, pieces);
    }
    memory.describe(width_px, found);
}

impl<T: Level> Memory<T> {
    #[inline(always)]
    fn describe(&mut self, width_px: f32, found: &mut Centrelines) {
        let Self { crossings, pieces, differences, averager, gains, spare, .. } = self;
        let lines = pieces.iter().map(|piece| PieceOf { crossings, piece });
        let scatter = Scatter::measure(lines, 0.0, differences);
        averager.prepare(width_px, &scatter);
        gains.clear();
        spare.extend(found.segments.drain(pieces.len().min(found.segments.len())..));
        spare.truncate(SPARE_SEGMENTS);
        found.segments.resize_with(pieces.len(), || spare.pop().unwrap_or_default());
        for (piece, segment) in pieces.iter().zip(&mut found.segments) {
            let kept = without_bent_ends(&PieceOf { crossings, piece }, &scatter);
            let start = piece.places.start;
            let piece =
                Piece { first_u: piece.first_u + kept.start, places: start + kept.start..start + kept.end };
            segment.points.clear();
            averager.average(crossings, &piece, &scatter, &mut segment.points, gains);
        }
        // A fit that keeps the mean keeps the noise at long waves: variance × correlation length is conserved.
        let gain = median(gains).map_or(1.0, f64::from);
        found.correlation_px = (gain * scatter.correlation_px()).max(1.0);
    }
}

/// Median; `None` of nothing.
fn median(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

#[cfg(test)]
mod tests;
