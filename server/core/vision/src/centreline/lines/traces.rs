//! Traces: lines followed over the columns of an image.

use std::ops::Range;

use super::candidates::Candidate;
use crate::params::{
    LINK_HEADING_COLUMNS, LONG_SEGMENT_COLUMNS, MIN_SEGMENT_COLUMNS, SHORT_SEGMENT_MIN_SNR, STRIP_WIDTH_PX,
};

/// One line followed over neighbouring columns, at whole-pixel accuracy: one step per column, without gaps.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Column of the first step.
    pub first_u: usize,
    /// Row of every step, interpolated where the column had no candidate.
    pub v: Vec<f32>,
    /// Grey levels above the brighter flank.
    pub contrast: Vec<f32>,
    /// Rows to the nearest other trace in this column.
    pub clearance_px: Vec<f32>,
    /// Steps with a candidate.
    n_seen: usize,
    /// Steps whose candidate reaches the signal-to-noise ratio that a short segment needs.
    n_clear: usize,
}

/// Clearance of a trace without neighbours.
pub const NO_NEIGHBOUR: f32 = f32::INFINITY;

/// Columns in a [`Stretch`].
pub const STRETCH: usize = STRIP_WIDTH_PX;

/// The candidates of one line in neighbouring columns, one in each.
#[derive(Debug, Clone, Copy)]
pub struct Stretch {
    /// Rows.
    pub v: [f32; STRETCH],
    /// Mean grey levels of the box above its brighter flank.
    pub contrast: [f32; STRETCH],
    /// Contrast over its standard deviation.
    pub snr: [f32; STRETCH],
}

impl Trace {
    /// Number of steps.
    pub fn len(&self) -> usize {
        self.v.len()
    }

    /// The steps that lie in some columns.
    #[inline(always)]
    pub fn within(&self, columns: &Range<usize>) -> Range<usize> {
        columns.start.max(self.first_u)..columns.end.min(self.first_u + self.len())
    }

    /// Adds a step.
    #[inline(always)]
    pub fn push(&mut self, candidate: &Candidate) {
        self.v.push(candidate.v as f32);
        self.contrast.push(candidate.contrast);
        self.n_seen += 1;
        self.n_clear += usize::from(candidate.snr >= SHORT_SEGMENT_MIN_SNR);
    }

    /// Whether this is a line rather than noise, by the median of its signal-to-noise ratio.
    #[inline(always)]
    pub fn is_significant(&self) -> bool {
        let n = self.len();
        let most_are = |n_good: usize| n - n_good <= n / 2;
        n >= MIN_SEGMENT_COLUMNS && (most_are(self.n_clear) || n >= LONG_SEGMENT_COLUMNS && most_are(self.n_seen))
    }
}

/// A trace that may still grow.
#[derive(Default)]
pub struct Open {
    pub trace: Trace,
    /// Row of its last step.
    pub last_v: f32,
    /// Column after its last step.
    pub next_u: usize,
    /// Slope of the trace, rows per column.
    pub heading: f32,
}

/// Weight of a new slope in the heading of a trace of `n_steps` steps.
#[inline(always)]
fn heading_rate(n_steps: usize) -> f32 {
    const OF_MANY: f32 = 1.0 / LINK_HEADING_COLUMNS as f32;
    if n_steps > LINK_HEADING_COLUMNS { OF_MANY } else { 1.0 / (n_steps as f32 - 1.0).max(1.0) }
}

impl Open {
    /// Starts with a candidate, reusing the memory of `trace`.
    pub fn begin(candidate: &Candidate, mut trace: Trace) -> Self {
        trace.v.clear();
        trace.contrast.clear();
        (trace.first_u, trace.n_seen, trace.n_clear) = (candidate.u as usize, 0, 0);
        trace.push(candidate);
        Self { last_v: candidate.v as f32, next_u: trace.first_u + 1, heading: 0.0, trace }
    }

    /// Row expected in column `u`.
    #[inline(always)]
    pub fn expected(&self, u: usize) -> f32 {
        self.last_v + self.heading * (u + 1 - self.next_u) as i32 as f32
    }

    /// Appends a candidate; columns without one before it are interpolated.
    #[inline(always)]
    pub fn grow(&mut self, candidate: &Candidate) {
        let v = candidate.v as f32;
        let n = candidate.u as usize + 1 - self.next_u;
        let mut slope = v - self.last_v;
        if n > 1 {
            slope /= n as f32;
            let last = self.trace.contrast.last().map_or(candidate.contrast, |&last| last);
            let (from_v, contrast) = (self.last_v, last.min(candidate.contrast));
            self.trace.v.extend((1..n).map(|i| from_v + slope * i as f32));
            self.trace.contrast.resize(self.trace.v.len(), contrast);
        }
        (self.last_v, self.next_u) = (v, candidate.u as usize + 1);
        self.trace.push(candidate);
        self.heading += (slope - self.heading) * heading_rate(self.trace.len());
    }

    /// The heading after a stretch, if every step of it lies within the gate.
    #[inline(always)]
    pub fn heading_after(&self, stretch: &Stretch, gate: f32) -> Option<f32> {
        let (mut last_v, mut heading) = (self.last_v, self.heading);
        let mut within = true;
        for (n, v) in (self.trace.len() + 1..).zip(stretch.v) {
            within &= (v - (last_v + heading)).abs() <= gate;
            heading += ((v - last_v) - heading) * heading_rate(n);
            last_v = v;
        }
        within.then_some(heading)
    }

    /// Appends a stretch, after which the heading is `heading`.
    #[inline(always)]
    pub fn grow_by(&mut self, stretch: &Stretch, heading: f32) {
        self.trace.v.extend_from_slice(&stretch.v);
        self.trace.contrast.extend_from_slice(&stretch.contrast);
        self.trace.n_seen += STRETCH;
        self.trace.n_clear +=
            stretch.snr.iter().map(|&snr| usize::from(snr >= SHORT_SEGMENT_MIN_SNR)).sum::<usize>();
        (self.last_v, self.heading) = (stretch.v[STRETCH - 1], heading);
        self.next_u += STRETCH;
    }
}

/// Whether consecutive stretches are more than `rows` apart in every column.
#[inline(always)]
pub fn are_apart(stretches: &[Stretch], rows: f32) -> bool {
    let mut apart = true;
    for [upper, lower] in stretches.array_windows() {
        for i in 0..STRETCH {
            apart &= lower.v[i] - upper.v[i] > rows;
        }
    }
    apart
}
