//! Light of a neighbouring line under a crossing, which moves its centre towards the neighbour.

use std::ops::Range;

use super::pieces::{Crossings, stated_width};
use super::ridge::decay;
use super::taps::Taps;
use crate::centreline::lines::taps::WIDTH_PER_SIGMA;
use crate::centreline::lines::traces::Trace;
use crate::params::{NEIGHBOUR_LIGHT_WIDTHS, PULL_MATTERS_WIDTHS, TOUCHING_WIDTHS};

/// The traces of an image, and the index of each one's first crossing.
#[derive(Clone, Copy)]
pub struct MeasuredTraces<'a> {
    pub traces: &'a [Trace],
    pub starts: &'a [usize],
    /// Typical full width of the lines.
    pub width_px: f32,
}

impl MeasuredTraces<'_> {
    /// Moves the crossings in some columns back by what the tails of their neighbours moved them, and returns the
    /// number of crossings that have no centre because another line is too close. `shifts` is scratch memory.
    #[inline(always)]
    pub fn release(
        self,
        columns: &[Range<usize>],
        crossings: &mut Crossings,
        shifts: &mut Vec<(usize, f64)>,
    ) -> usize {
        shifts.clear();
        let mut n_touching = 0;
        for columns in columns {
            for own in (0..self.traces.len()).filter(|&own| self.has_neighbour(own, columns)) {
                for other in (0..self.traces.len()).filter(|&other| other != own) {
                    n_touching += self.add_pulls(own, other, columns, crossings, shifts);
                }
            }
        }
        for &(place, shift) in &*shifts {
            crossings.v[place] -= shift;
        }
        n_touching
    }

    /// Whether another line is close to a trace in some of the columns.
    #[inline(always)]
    fn has_neighbour(self, own: usize, columns: &Range<usize>) -> bool {
        let trace = &self.traces[own];
        let within = trace.within(columns);
        if within.is_empty() {
            return false;
        }
        let limit_px = PULL_MATTERS_WIDTHS * self.width_px;
        let clearances = &trace.clearance_px[within.start - trace.first_u..within.end - trace.first_u];
        clearances.iter().fold(false, |any, &clearance_px| any | (clearance_px < limit_px))
    }

    /// Adds how far the second trace moved the crossings of the first, and counts those it hides.
    #[inline(always)]
    fn add_pulls(
        self,
        own: usize,
        other: usize,
        columns: &Range<usize>,
        crossings: &Crossings,
        shifts: &mut Vec<(usize, f64)>,
    ) -> usize {
        let (a, b) = (&self.traces[own], &self.traces[other]);
        let (in_a, in_b) = (a.within(columns), b.within(columns));
        let both = in_a.start.max(in_b.start)..in_a.end.min(in_b.end);
        let mut n_touching = 0;
        for u in both {
            let (at_a, at_b) = (u - a.first_u, u - b.first_u);
            let apart_px = (a.v[at_a] - b.v[at_b]).abs();
            if apart_px > PULL_MATTERS_WIDTHS * self.width_px {
                continue;
            }
            let (own, other) = (self.starts[own] + at_a, self.starts[other] + at_b);
            if !crossings.found[own] {
                n_touching += usize::from(apart_px < TOUCHING_WIDTHS * self.width_px);
            } else if crossings.found[other] {
                let pull = pull(crossings, own, other);
                if pull != 0.0 {
                    shifts.push((own, f64::from(pull)));
                }
            }
        }
        n_touching
    }
}

/// How far one line moved the centre of another, rows: its slope there over the other's curvature,
///
/// − (A₂ Σ k′ⱼ g(j − d)) / (A₁ Σ k″ⱼ g(j)),
///
/// with the kernel's derivatives k′ and k″, areas A, a bell g as wide as the line, and the distance d.
#[inline(always)]
fn pull(crossings: &Crossings, own: usize, other: usize) -> f32 {
    let distance = (crossings.v[other] - crossings.v[own]) as f32;
    let measured = WIDTH_PER_SIGMA / crossings.width_px[own];
    // The variance kept is that of kernel and line, both as bells, multiplied.
    let kernel = 1.0 / (1.0 / crossings.cross_variance_px2[own] - measured * measured).max(1e-3);
    let taps = Taps::of_variance(kernel);
    let width_px = stated_width(crossings.width_px[own]);
    let is_far = distance.abs() > taps.reach as f32 + NEIGHBOUR_LIGHT_WIDTHS * width_px;
    if is_far || crossings.area[own] <= 0.0 || crossings.area[other] <= 0.0 {
        return 0.0;
    }
    let per_sigma = WIDTH_PER_SIGMA / width_px;
    let bell = |x: f32| decay(0.5 * (x * per_sigma) * (x * per_sigma));
    let (mut slope, mut curvature) = (0.0, 0.0);
    for (j, [first, second]) in (-(taps.reach as i32)..).zip(&taps.weights) {
        slope += first * bell(j as f32 - distance);
        curvature += second * bell(j as f32);
    }
    -slope / curvature * (crossings.area[other] / crossings.area[own])
}
