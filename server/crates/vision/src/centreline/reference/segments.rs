//! Candidates joined, column by column, into traces of one line each.

use std::cmp::Ordering;

use super::candidates::Candidate;
use crate::params::{
    LINK_GATE_MIN_PX, LINK_GATE_WIDTHS, LINK_HEADING_COLUMNS, LINK_MAX_GAP_COLUMNS, LONG_SEGMENT_COLUMNS,
    MIN_SEGMENT_COLUMNS, RIVAL_CONTRAST, SHORT_SEGMENT_MIN_SNR,
};

/// One line followed over neighbouring columns, at whole-pixel accuracy.
#[derive(Debug, Clone)]
pub struct Trace {
    /// Column of the first step.
    pub first_u: usize,
    /// One step per column, without gaps.
    pub steps: Vec<Step>,
}

/// A trace in one column.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Row, interpolated where the column had no candidate.
    pub v: f32,
    /// Grey levels above the brighter flank.
    pub contrast: f32,
    /// Contrast over its standard deviation; 0 where interpolated.
    pub snr: f32,
    /// Rows to the nearest other trace in this column.
    pub clearance_px: f32,
}

/// Clearance of a trace that is alone.
const ALONE: f32 = f32::INFINITY;

/// A trace that may still grow.
struct Open {
    trace: Trace,
    /// Row of its last step.
    last_v: f32,
    /// Column after its last step.
    next_u: usize,
    /// Rows per column the trace is heading.
    heading: f32,
}

impl Open {
    /// Begins with a candidate, in memory that was used before.
    fn begin(candidate: &Candidate, mut steps: Vec<Step>) -> Self {
        steps.clear();
        steps.push(Step {
            v: candidate.v as f32,
            contrast: candidate.contrast,
            snr: candidate.snr,
            clearance_px: ALONE,
        });
        let first_u = candidate.u as usize;
        Self { trace: Trace { first_u, steps }, last_v: candidate.v as f32, next_u: first_u + 1, heading: 0.0 }
    }

    /// Row expected in column `u`.
    #[inline(always)]
    fn expected(&self, u: usize) -> f32 {
        self.last_v + self.heading * (u + 1 - self.next_u) as i32 as f32
    }

    #[inline(always)]
    fn grow(&mut self, candidate: &Candidate) {
        let v = candidate.v as f32;
        let n = candidate.u as usize + 1 - self.next_u;
        let mut slope = v - self.last_v;
        if n > 1 {
            slope /= n as f32;
            let last = self.trace.steps.last().map_or(candidate.contrast, |last| last.contrast);
            let (from_v, contrast) = (self.last_v, last.min(candidate.contrast));
            let between =
                (1..n).map(|i| Step { v: from_v + slope * i as f32, contrast, snr: 0.0, clearance_px: ALONE });
            self.trace.steps.extend(between);
        }
        (self.last_v, self.next_u) = (v, candidate.u as usize + 1);
        self.trace.steps.push(Step { v, contrast: candidate.contrast, snr: candidate.snr, clearance_px: ALONE });
        let memory = LINK_HEADING_COLUMNS.min(self.trace.steps.len() as f32 - 1.0).max(1.0);
        self.heading += (slope - self.heading) / memory;
    }
}

/// Joins candidates into traces; keeps its memory from image to image.
#[derive(Default)]
pub struct Linker {
    open: Vec<Open>,
    /// Where every open trace is expected in the column at hand, in order, and whether it has its candidate.
    expected: Vec<f32>,
    taken: Vec<bool>,
    closed: Vec<Trace>,
    spare: Vec<Vec<Step>>,
}

impl Linker {
    /// Joins candidates (ordered by column, then row) into traces, ordered by first column, then row.
    ///
    /// A candidate continues the trace that expected it nearest by, if that trace has no nearer candidate, within
    /// the link gate; a jump ends the trace. Short or faint traces are dropped.
    #[inline(always)]
    pub fn link(&mut self, candidates: &[Candidate], width_px: f32) -> &mut [Trace] {
        let gate = (LINK_GATE_WIDTHS * width_px).max(LINK_GATE_MIN_PX);
        self.spare.extend(self.closed.drain(..).map(|trace| trace.steps));
        for column in candidates.chunk_by(|a, b| a.u == b.u) {
            self.add_column(column, gate);
        }
        let (open, closed) = (&mut self.open, &mut self.closed);
        closed.extend(open.drain(..).map(|o| o.trace));
        let (spare, believed) = (&mut self.spare, &mut self.closed);
        let mut idx = 0;
        while idx < believed.len() {
            if believable(&believed[idx]) {
                idx += 1;
            } else {
                spare.push(believed.swap_remove(idx).steps);
            }
        }
        believed.sort_unstable_by(|a, b| {
            (a.first_u, a.steps[0].v).partial_cmp(&(b.first_u, b.steps[0].v)).unwrap_or(Ordering::Equal)
        });
        believed
    }

    #[inline(always)]
    fn add_column(&mut self, column: &[Candidate], gate: f32) {
        let u = column[0].u as usize;
        if self.is_plain(column, gate) {
            for (open, candidate) in self.open.iter_mut().zip(column) {
                open.grow(candidate);
            }
            return;
        }
        self.close_stale(u);
        self.expect(u);
        let n_open = self.expected.len();
        self.taken.clear();
        self.taken.resize(n_open, false);
        let mut near = 0;
        for (idx, candidate) in column.iter().enumerate() {
            let row = candidate.v as f32;
            while near + 1 < n_open && (self.expected[near + 1] - row).abs() < (self.expected[near] - row).abs() {
                near += 1;
            }
            match self.continued(near, idx, column, gate) {
                Some(trace) => {
                    self.open[trace].grow(candidate);
                    self.taken[trace] = true;
                }
                None => {
                    let steps = self.spare.pop().unwrap_or_default();
                    self.open.push(Open::begin(candidate, steps));
                }
            }
        }
    }

    /// Where every open trace is expected in column `u`, in this order.
    #[inline(always)]
    fn expect(&mut self, u: usize) {
        self.expected.clear();
        self.expected.extend(self.open.iter().map(|open| open.expected(u)));
        if !self.expected.is_sorted() {
            self.open.sort_by(|a, b| a.expected(u).total_cmp(&b.expected(u)));
            self.expected.clear();
            self.expected.extend(self.open.iter().map(|open| open.expected(u)));
        }
    }

    /// Whether every trace goes on with its one candidate within the gate and all are so far apart that no other comes
    /// near.
    #[inline(always)]
    fn is_plain(&self, column: &[Candidate], gate: f32) -> bool {
        if column.len() != self.open.len() {
            return false;
        }
        let mut before = f32::NEG_INFINITY;
        let mut is_plain = true;
        for (open, candidate) in self.open.iter().zip(column) {
            let u = candidate.u as usize;
            let expected = open.expected(u);
            is_plain &= (candidate.v as f32 - expected).abs() <= gate;
            is_plain &= expected - before > 4.0 * gate;
            is_plain &= open.next_u + LINK_MAX_GAP_COLUMNS >= u;
            before = expected;
        }
        is_plain
    }

    /// The trace that the candidate `idx` of a column continues: nearest to it and, among the column's candidates, with
    /// none nearer. `near` is expected nearest to it; where it has its candidate, those beside it are asked.
    #[inline(always)]
    fn continued(&self, near: usize, idx: usize, column: &[Candidate], gate: f32) -> Option<usize> {
        let miss = |trace: usize, candidate: &Candidate| (candidate.v as f32 - self.expected[trace]).abs();
        let here = &column[idx];
        let free = |trace: &usize| self.taken.get(*trace) == Some(&false);
        let nearest = if free(&near) {
            near
        } else {
            let before = (0..near).rev().find(free);
            let after = (near + 1..self.taken.len()).find(free);
            before.into_iter().chain(after).min_by(|&a, &b| miss(a, here).total_cmp(&miss(b, here)))?
        };
        let distance = miss(nearest, here);
        if distance > gate {
            return None;
        }
        let beside = [idx.wrapping_sub(1), idx + 1];
        let rival = beside.iter().filter_map(|&i| column.get(i)).any(|other| miss(nearest, other) < distance);
        (!rival).then_some(nearest)
    }

    #[inline(always)]
    fn close_stale(&mut self, u: usize) {
        let mut idx = 0;
        while idx < self.open.len() {
            if self.open[idx].next_u + LINK_MAX_GAP_COLUMNS < u {
                let done = self.open.remove(idx).trace;
                if done.steps.len() >= MIN_SEGMENT_COLUMNS {
                    self.closed.push(done);
                } else {
                    self.spare.push(done.steps);
                }
            } else {
                idx += 1;
            }
        }
    }
}

/// Notes at every step how far the nearest other trace is that is bright enough to matter.
pub fn mark_clearances(traces: &mut [Trace]) {
    let steps = |trace: &Trace| {
        let first_u = trace.first_u;
        trace.steps.iter().enumerate().map(move |(i, s)| (first_u + i, s.v, s.contrast)).collect::<Vec<_>>()
    };
    let mut all: Vec<(usize, f32, f32)> = traces.iter().flat_map(steps).collect();
    all.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for trace in traces {
        for (idx, step) in trace.steps.iter_mut().enumerate() {
            let u = trace.first_u + idx;
            let here = all.partition_point(|&(other_u, v, _)| (other_u, v) < (u, step.v));
            let beside = [here.checked_sub(1), Some(here + 1)];
            let others = beside
                .into_iter()
                .flatten()
                .filter_map(|i| all.get(i))
                .filter(|other| other.0 == u && other.2 >= RIVAL_CONTRAST * step.contrast);
            step.clearance_px = others.map(|other| (other.1 - step.v).abs()).fold(ALONE, f32::min);
        }
    }
}

/// Whether a trace is a line rather than a chance row of noise: by the median of its signal-to-noise.
#[inline(always)]
fn believable(trace: &Trace) -> bool {
    let n = trace.steps.len();
    if n < MIN_SEGMENT_COLUMNS {
        return false;
    }
    let median_reaches = |reaches: fn(f32) -> bool| {
        let n_below = trace.steps.iter().map(|step| u32::from(!reaches(step.snr))).sum::<u32>();
        n_below as usize <= n / 2
    };
    median_reaches(|snr| snr >= SHORT_SEGMENT_MIN_SNR)
        || n >= LONG_SEGMENT_COLUMNS && median_reaches(|snr| snr > 0.0)
}
