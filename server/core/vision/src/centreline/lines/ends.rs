//! The ends of interrupted lines, where blur spreads light beyond the line.

use std::ops::Range;

use super::crossing::{Crossing, Line};
use super::parabola::parabola;
use super::scatter::Scatter;
use crate::params::{
    END_CHECK_WIDTHS, END_DEPARTURE_MIN_PX, END_DEPARTURE_SIGMAS, END_INTENSITY_FRACTION, END_MAX_COLUMNS,
    END_REFERENCE_WIDTHS,
};

/// The columns of an interrupted line, without the ends over which it fades.
#[inline(always)]
pub fn without_faded_ends<L: Line>(line: &L) -> Range<usize> {
    let n = line.n_columns();
    let start = n_faded(n, |i| line.at(i));
    let end = n - n_faded(n, |i| line.at(n - 1 - i));
    start.min(end)..end
}

/// Crossings at the start of `inward` that are much fainter than those within two line widths.
#[inline(always)]
fn n_faded(n: usize, inward: impl Fn(usize) -> Crossing) -> usize {
    let n_near = (0..n.min(END_MAX_COLUMNS)).take_while(|&i| (i as f32) <= 2.0 * inward(i).width_px + 1.0).count();
    let mut sorted = [0.0f32; END_MAX_COLUMNS];
    let sorted = &mut sorted[..n_near];
    sorted.iter_mut().enumerate().for_each(|(i, intensity)| *intensity = inward(i).intensity);
    sorted.sort_unstable_by(f32::total_cmp);
    let full = sorted.get(n_near * 3 / 4).copied().unwrap_or(0.0);
    (0..n_near).take_while(|&i| inward(i).intensity < END_INTENSITY_FRACTION * full).count()
}

/// The columns of a line, without the ends that bend away from the line further in: the round end of a bright sloping
/// line as it appears in the columns beside it, or the light of another line that begins there.
#[inline(always)]
pub fn without_bent_ends<L: Line>(line: &L, scatter: &Scatter) -> Range<usize> {
    let n = line.n_columns();
    let start = n_bent(line, scatter, |i| i);
    let end = n - n_bent(line, scatter, |i| n - 1 - i);
    start.min(end)..end
}

/// Number of crossings at one end (counted inwards by `inward`) that leave the parabola through the line further in.
#[inline(always)]
fn n_bent<L: Line>(line: &L, scatter: &Scatter, inward: impl Fn(usize) -> usize) -> usize {
    let n = line.n_columns();
    if n == 0 {
        return 0;
    }
    let width_px = line.at(n / 2).width_px;
    let n_checked = (END_CHECK_WIDTHS * width_px).ceil() as usize;
    let n_reference = (END_REFERENCE_WIDTHS * width_px).ceil() as usize;
    if n < n_checked + n_reference {
        return 0;
    }
    let base = line.at(inward(n_checked)).v;
    let x_of = |i: usize| i as f64 - n_checked as f64;
    let reference = (n_checked..n_checked + n_reference).map(|i| {
        let crossing = line.at(inward(i));
        (x_of(i), crossing.v - base, 1.0 / scatter.variance(&crossing).max(1e-8))
    });
    let Some(fit) = parabola(reference) else { return 0 };
    let shared = scatter.correlation_px();
    let departs = |i: &usize| {
        let crossing = line.at(inward(*i));
        let (expected, variance) = fit.at(x_of(*i));
        let sigma = (shared * variance + scatter.variance(&crossing)).sqrt();
        (crossing.v - base - expected).abs() > (END_DEPARTURE_SIGMAS * sigma).max(END_DEPARTURE_MIN_PX)
    };
    (0..n_checked).rev().find(departs).map_or(0, |i| i + 1)
}
