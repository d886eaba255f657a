//! The ends of interrupted lines, where blur shows light on no line.

use super::along::parabola;
use super::crossing::Crossing;
use super::scatter::Scatter;
use crate::params::{
    END_CHECK_WIDTHS, END_DEPARTURE_MIN_PX, END_DEPARTURE_SIGMAS, END_INTENSITY_FRACTION, END_REFERENCE_WIDTHS,
};

/// Leaves out the ends over which an interrupted line fades.
pub fn without_faded_ends(line: &[Crossing]) -> &[Crossing] {
    let start = n_faded(line.iter());
    let end = line.len() - n_faded(line.iter().rev());
    &line[start.min(end)..end]
}

/// Crossings at the start of `inward` that are much fainter than those within two line widths.
fn n_faded<'a>(inward: impl Iterator<Item = &'a Crossing>) -> usize {
    let near: Vec<f32> = inward
        .enumerate()
        .take_while(|(i, c)| (*i as f32) <= 2.0 * c.width_px + 1.0)
        .map(|(_, c)| c.intensity)
        .collect();
    let mut sorted = near.clone();
    sorted.sort_unstable_by(f32::total_cmp);
    let full = sorted.get(sorted.len() * 3 / 4).copied().unwrap_or(0.0);
    near.iter().take_while(|&&intensity| intensity < END_INTENSITY_FRACTION * full).count()
}

/// Leaves out the ends that bend away from the line further in: the round end of a bright sloping line seen in the
/// columns beside it, or the light of another line that begins there.
pub fn without_bent_ends<'a>(line: &'a [Crossing], scatter: &Scatter) -> &'a [Crossing] {
    let start = n_bent(line, scatter, |i| i);
    let end = line.len() - n_bent(line, scatter, |i| line.len() - 1 - i);
    &line[start.min(end)..end]
}

/// Crossings at one end (counted inwards by `inward`) that leave the parabola through the line further in.
fn n_bent(line: &[Crossing], scatter: &Scatter, inward: impl Fn(usize) -> usize) -> usize {
    let Some(width_px) = line.get(line.len() / 2).map(|c| c.width_px) else { return 0 };
    let n_checked = (END_CHECK_WIDTHS * width_px).ceil() as usize;
    let n_reference = (END_REFERENCE_WIDTHS * width_px).ceil() as usize;
    if line.len() < n_checked + n_reference {
        return 0;
    }
    let base = line[inward(n_checked)].v;
    let x_of = |i: usize| i as f64 - n_checked as f64;
    let reference = (n_checked..n_checked + n_reference).map(|i| {
        let crossing = &line[inward(i)];
        (x_of(i), crossing.v - base, 1.0 / scatter.variance(crossing).max(1e-8))
    });
    let Some(fit) = parabola(reference) else { return 0 };
    let departs = |i: &usize| {
        let crossing = &line[inward(*i)];
        let (expected, variance) = fit.at(x_of(*i));
        let sigma = (scatter.correlation_px() * variance + scatter.variance(crossing)).sqrt();
        (crossing.v - base - expected).abs() > (END_DEPARTURE_SIGMAS * sigma).max(END_DEPARTURE_MIN_PX)
    };
    (0..n_checked).rev().find(departs).map_or(0, |i| i + 1)
}
