//! Centreline extraction at camera speed: every pixel is read once, and later steps visit only the lit parts of the
//! image.
//!
//! Noise from a sample of rows → sums of small cells, which show where lines can be → candidates there (a box brighter
//! than both flanks) → traces → every crossing straightened into a window, sixteen columns at a time, and measured by
//! derivatives across the line → averaging along the line. All arithmetic is done per lane and without fused
//! multiply-add, so that every instruction set gives bit-identical results.

#![allow(
    clippy::needless_range_loop,
    reason = "several arrays side by side, lane by lane, is what compilers turn into vectors"
)]

mod across;
mod lanes;
mod search;
mod smoothing;
#[cfg(test)]
mod tests;

use multiversion::{inherit_target, multiversion};

use super::lines::candidates::Boxes;
use super::lines::ends::without_bent_ends;
use super::lines::noise::NoiseMap;
use super::lines::scatter::{Differences, Scatter};
use super::lines::segments::Linker;
use super::view::{Level, View};
use super::{Centrelines, Segment};
use crate::params::NOISE_TILE_PX;
use across::block::Image;
use across::crossings::Measurer;
use across::pieces::{Crossings, Piece, PieceOf};
use search::candidates::Search;
use search::cells::Cells;
use search::noise::{BoxNoise, PixelNoise};
use search::width::Peaks;
use smoothing::along::Averager;

pub use search::cells::Strip;
pub use smoothing::expected::AveragingBias;
use statistics::median;

/// Smallest image side, in pixels, that holds the tiles and strips of the search.
pub const MIN_SIDE_PX: usize = 64;

/// Segments whose memory is kept between images: enough for usual scenes, so that the memory used for a very noisy
/// image is freed.
const SPARE_SEGMENTS: usize = 64;

/// Whether an image is large enough; see [`super::small`].
pub fn fits(width: usize, height: usize) -> bool {
    width.min(height) >= MIN_SIDE_PX
}

/// Working memory of the extraction, reused from image to image.
#[derive(Default)]
pub struct Memory<T: Level> {
    cells: Cells<T>,
    pixel_noise: PixelNoise<T>,
    strips: Vec<Strip>,
    peaks: Peaks,
    /// Typical full width at half height.
    width_px: f32,
    /// The width set by the caller, if any.
    given_width_px: Option<f32>,
    box_noise: BoxNoise<T>,
    search: Search<T>,
    linker: Linker,
    /// Traces close to each other.
    near: Vec<usize>,
    measurer: Measurer<T>,
    crossings: Crossings,
    pieces: Vec<Piece>,
    differences: Differences,
    averager: Averager,
    gains: Vec<f32>,
    /// Spare segments, with the memory of their points.
    spare: Vec<Segment>,
}

/// The extraction compiled for every instruction set, one function per step: in a single function of that size
/// compilers keep the sums of inner loops in memory instead of registers.
macro_rules! extraction {
    ($(#[$doc:meta])* $name:ident, $level:ty) => {
        $(#[$doc])*
        // Where the target already includes the best of these instruction sets, the named versions are unused.
        #[allow(dead_code)]
        #[cfg_attr(
            not(test),
            multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))
        )]
        // Unit tests run the baseline of x86-64, and `tests/it` what the machine chooses: compiling all versions again
        // took most of the time of a build of these tests.
        #[cfg_attr(test, multiversion(targets("aarch64+neon")))]
        pub fn $name(view: &View<$level>, memory: &mut Memory<$level>, found: &mut Centrelines) {
            #[inherit_target]
            #[inline(never)]
            fn read(view: &View<$level>, memory: &mut Memory<$level>) {
                memory.read(view);
            }
            #[inherit_target]
            #[inline(never)]
            fn estimate_width(view: &View<$level>, memory: &mut Memory<$level>) {
                memory.estimate_width(view);
            }
            #[inherit_target]
            #[inline(never)]
            fn measure_box_noise(view: &View<$level>, memory: &mut Memory<$level>) {
                memory.measure_box_noise(view);
            }
            #[inherit_target]
            #[inline(never)]
            fn search(view: &View<$level>, memory: &mut Memory<$level>) {
                memory.search(view);
            }
            #[inherit_target]
            #[inline(never)]
            fn measure(view: &View<$level>, memory: &mut Memory<$level>) {
                memory.measure(view);
            }
            #[inherit_target]
            #[inline(never)]
            fn average_along_lines(memory: &mut Memory<$level>, found: &mut Centrelines) {
                memory.average_along_lines(found);
            }
            read(view, memory);
            estimate_width(view, memory);
            measure_box_noise(view, memory);
            search(view, memory);
            measure(view, memory);
            average_along_lines(memory, found);
        }
    };
}

extraction!(
    /// The lines of an image of 8 bits.
    extract_eight,
    u8
);
extraction!(
    /// The lines of an image of 16 bits.
    extract_sixteen,
    u16
);

impl<T: Level> Memory<T> {
    /// Sets the full width at half height of the lines to search for, instead of estimating it from each image.
    pub fn search_width(&mut self, width_px: f32) {
        self.given_width_px = Some(width_px);
    }

    /// The full width at half height used for the last image.
    pub fn width_px(&self) -> f32 {
        self.width_px
    }

    /// The noise of the last image's pixels.
    pub fn noise(&self) -> &NoiseMap {
        self.pixel_noise.map()
    }

    /// The strips of the last image that held light.
    pub fn strips(&self) -> &[Strip] {
        &self.strips
    }

    /// The only pass over every pixel: finds the lit cells and the noise of pixels.
    #[inline(always)]
    fn read(&mut self, view: &View<T>) {
        self.cells.begin(view);
        self.pixel_noise.begin(view);
        for v0 in (0..view.height).step_by(NOISE_TILE_PX) {
            // The rows read here are still cached when their noise is measured.
            self.cells.sum_up(view, v0..(v0 + NOISE_TILE_PX).min(view.height));
            self.pixel_noise.measure(view, v0);
        }
        self.cells.strips_with_light(view, self.pixel_noise.map(), &mut self.strips);
    }

    /// Estimates the width of the lines.
    #[inline(always)]
    fn estimate_width(&mut self, view: &View<T>) {
        // Not in a closure, which would be compiled for the baseline.
        self.width_px = match self.given_width_px {
            Some(width_px) => width_px,
            None => search::width::typical_width_px(view, self.pixel_noise.map(), &self.strips, &mut self.peaks),
        };
    }

    /// Measures the noise that candidates are compared with.
    #[inline(always)]
    fn measure_box_noise(&mut self, view: &View<T>) {
        let boxes = Boxes::for_width(self.width_px);
        self.box_noise.measure(view, boxes, self.pixel_noise.map(), &self.strips);
    }

    /// Finds candidates and links them into traces.
    #[inline(always)]
    fn search(&mut self, view: &View<T>) {
        let Self { search, strips, linker, width_px, .. } = self;
        let (noise, boxes) = (self.box_noise.map(), Boxes::for_width(*width_px));
        linker.begin(*width_px);
        search.candidates(view, noise, boxes, *width_px, strips, linker);
        linker.finish();
        across::clearance::mark_clearances(linker.traces_mut(), search.crowded(), &mut self.near);
    }

    /// Measures the crossings of all traces and splits them into pieces of lines.
    #[inline(always)]
    fn measure(&mut self, view: &View<T>) {
        let image = Image::new(view, self.pixel_noise.map(), Boxes::for_width(self.width_px), self.width_px);
        self.crossings.clear();
        self.pieces.clear();
        for trace in self.linker.traces_mut() {
            let start = self.measurer.measure(&image, trace, &mut self.crossings);
            self.crossings.cut(trace.first_u, start, &mut self.pieces);
        }
    }

    /// Averages along the lines.
    #[inline(always)]
    fn average_along_lines(&mut self, found: &mut Centrelines) {
        let Self { crossings, pieces, differences, averager, gains, spare, width_px, .. } = self;
        let lines = pieces.iter().map(|piece| PieceOf { crossings, piece });
        let scatter = Scatter::measure(lines, 0.0, differences);
        averager.prepare(*width_px, &scatter);
        gains.clear();
        spare.extend(found.segments.drain(pieces.len().min(found.segments.len())..));
        spare.truncate(SPARE_SEGMENTS);
        found.segments.resize_with(pieces.len(), || spare.pop().unwrap_or_default());
        for (piece, segment) in pieces.iter().zip(&mut found.segments) {
            let kept = without_bent_ends(&PieceOf { crossings, piece }, &scatter);
            let start = piece.places.start;
            let piece =
                Piece { first_u: piece.first_u + kept.start, places: start + kept.start..start + kept.end };
            averager.average(crossings, &piece, &scatter, &mut segment.points, gains);
        }
        // A fit that preserves the mean preserves the noise at long wavelengths: variance × correlation length is
        // constant.
        let gain = median(gains).map_or(1.0, f64::from);
        found.correlation_px = (gain * scatter.correlation_px()).max(1.0);
    }
}
