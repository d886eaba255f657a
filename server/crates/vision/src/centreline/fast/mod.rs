//! The extraction at the speed of the camera: the whole image is read once, everything else only where light is.
//!
//! Noise from some rows → sums of small cells, which tell where lines can be → candidates there, as the reference
//! finds them → traces → every crossing straightened into a window, sixteen columns at a time, and measured by
//! derivatives across the line → averaging along the line. All arithmetic runs in lanes that do not mix and without
//! fused multiply-add, so that every instruction set gives the same bits.

mod along;
mod candidates;
mod cells;
mod clearance;
mod crossings;
mod noise;
mod taps;
mod width;
mod window;

use multiversion::multiversion;

use super::reference::candidates::Boxes;
use super::reference::crossing::Crossing;
use super::reference::ends::without_bent_ends;
use super::reference::scatter::Scatter;
use super::reference::segments::link_traces;
use super::reference::{median, pieces, point};
use super::view::{Level, View};
use super::{Centrelines, Segment};
use along::Averager;
use crossings::Measurer;

/// Smallest side, in pixels, that is worth the trouble: smaller images go the straightforward way.
const MIN_SIDE_PX: usize = 64;

/// Whether an image is large enough for this way.
pub fn large_enough(width: usize, height: usize) -> bool {
    width >= MIN_SIDE_PX && height >= MIN_SIDE_PX
}

/// The lines of an image of 8 bits.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
pub fn extract_eight(view: View<u8>) -> Centrelines {
    extract(&view)
}

/// The lines of an image of 16 bits.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
pub fn extract_sixteen(view: View<u16>) -> Centrelines {
    extract(&view)
}

/// The lines of an image, by whatever instructions the caller was compiled for.
#[inline(always)]
pub fn extract<T: Level>(view: &View<T>) -> Centrelines {
    let pixel_noise = noise::of_pixels(view);
    let strips = cells::strips_with_light(view, &pixel_noise);
    let width_px = width::typical_width_px(view, &pixel_noise, &strips);
    let boxes = Boxes::for_width(width_px);
    let box_noise = noise::of_boxes(view, boxes, &pixel_noise);
    let candidates = candidates::find_candidates(view, &box_noise, boxes, width_px, &strips);
    let mut traces = link_traces(&candidates, width_px);
    clearance::mark_clearances(&mut traces, view.width);
    let measurer = Measurer::new(view, &pixel_noise, boxes, width_px);
    let mut lines: Vec<Vec<Crossing>> = Vec::with_capacity(traces.len());
    for trace in &traces {
        lines.extend(pieces(&measurer.measure(trace)));
    }
    described(&lines, width_px)
}

#[inline(always)]
fn described(lines: &[Vec<Crossing>], width_px: f32) -> Centrelines {
    let scatter = Scatter::measure(lines, 0.0);
    let mut averager = Averager::new(width_px, &scatter);
    let mut gains = Vec::new();
    let mut segments = Vec::with_capacity(lines.len());
    for line in lines {
        let line = without_bent_ends(line, &scatter);
        let mut points = Vec::with_capacity(line.len());
        averager.average(line, &scatter, |crossing, variance, fit| {
            gains.push(variance / fit.variance);
            points.push(point(crossing, fit));
        });
        segments.push(Segment { points });
    }
    // A fit that keeps the mean keeps the noise at long waves: variance × correlation length is conserved.
    let gain = median(&mut gains).unwrap_or(1.0);
    Centrelines { segments, correlation_px: (gain * scatter.correlation_px()).max(1.0) }
}

#[cfg(test)]
mod tests;
