//! Candidates joined, column by column, into traces of one line each.

use std::cmp::Ordering;
use std::ops::Range;

use super::candidates::Candidate;
use crate::params::{
    LINK_GATE_MIN_PX, LINK_GATE_WIDTHS, LINK_HEADING_COLUMNS, LINK_MAX_GAP_COLUMNS, LONG_SEGMENT_COLUMNS,
    MIN_SEGMENT_COLUMNS, RIVAL_CONTRAST, SHORT_SEGMENT_MIN_SNR, STRIP_WIDTH_PX,
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
    /// Steps whose candidate has the signal-to-noise that a short segment needs.
    n_clear: usize,
}

/// Clearance of a trace that is alone.
const ALONE: f32 = f32::INFINITY;

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
    /// How many steps it has.
    pub fn len(&self) -> usize {
        self.v.len()
    }

    /// Those of some columns in which it has steps.
    #[inline(always)]
    pub fn within(&self, columns: &Range<usize>) -> Range<usize> {
        columns.start.max(self.first_u)..columns.end.min(self.first_u + self.len())
    }

    #[inline(always)]
    fn push(&mut self, candidate: &Candidate) {
        self.v.push(candidate.v as f32);
        self.contrast.push(candidate.contrast);
        self.n_seen += 1;
        self.n_clear += usize::from(candidate.snr >= SHORT_SEGMENT_MIN_SNR);
    }

    /// Whether this is a line rather than a chance row of noise: by the median of its signal-to-noise.
    #[inline(always)]
    fn is_believable(&self) -> bool {
        let n = self.len();
        let most_are = |n_good: usize| n - n_good <= n / 2;
        n >= MIN_SEGMENT_COLUMNS && (most_are(self.n_clear) || n >= LONG_SEGMENT_COLUMNS && most_are(self.n_seen))
    }
}

/// A trace that may still grow.
#[derive(Default)]
struct Open {
    trace: Trace,
    /// Row of its last step.
    last_v: f32,
    /// Column after its last step.
    next_u: usize,
    /// Rows per column the trace is heading.
    heading: f32,
}

/// The part of a new slope in the heading of a trace of so many steps.
#[inline(always)]
fn heading_rate(n_steps: usize) -> f32 {
    const OF_MANY: f32 = 1.0 / LINK_HEADING_COLUMNS as f32;
    if n_steps > LINK_HEADING_COLUMNS { OF_MANY } else { 1.0 / (n_steps as f32 - 1.0).max(1.0) }
}

impl Open {
    /// Begins with a candidate, in memory that was used before.
    fn begin(candidate: &Candidate, mut trace: Trace) -> Self {
        trace.v.clear();
        trace.contrast.clear();
        (trace.first_u, trace.n_seen, trace.n_clear) = (candidate.u as usize, 0, 0);
        trace.push(candidate);
        Self { last_v: candidate.v as f32, next_u: trace.first_u + 1, heading: 0.0, trace }
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
            let last = self.trace.contrast.last().map_or(candidate.contrast, |&last| last);
            let (from_v, contrast) = (self.last_v, last.min(candidate.contrast));
            self.trace.v.extend((1..n).map(|i| from_v + slope * i as f32));
            self.trace.contrast.resize(self.trace.v.len(), contrast);
        }
        (self.last_v, self.next_u) = (v, candidate.u as usize + 1);
        self.trace.push(candidate);
        self.heading += (slope - self.heading) * heading_rate(self.trace.len());
    }

    /// Where it heads after a stretch, if every step of it lies within the gate.
    #[inline(always)]
    fn heading_after(&self, stretch: &Stretch, gate: f32) -> Option<f32> {
        let (mut last_v, mut heading) = (self.last_v, self.heading);
        let mut within = true;
        for (n, v) in (self.trace.len() + 1..).zip(stretch.v) {
            within &= (v - (last_v + heading)).abs() <= gate;
            heading += ((v - last_v) - heading) * heading_rate(n);
            last_v = v;
        }
        within.then_some(heading)
    }

    #[inline(always)]
    fn grow_by(&mut self, stretch: &Stretch, heading: f32) {
        self.trace.v.extend_from_slice(&stretch.v);
        self.trace.contrast.extend_from_slice(&stretch.contrast);
        self.trace.n_seen += STRETCH;
        self.trace.n_clear +=
            stretch.snr.iter().map(|&snr| usize::from(snr >= SHORT_SEGMENT_MIN_SNR)).sum::<usize>();
        (self.last_v, self.heading) = (stretch.v[STRETCH - 1], heading);
        self.next_u += STRETCH;
    }
}

/// Joins candidates into traces; keeps its memory from image to image.
#[derive(Default)]
pub struct Linker {
    /// Rows from where a trace is expected within which a candidate continues it.
    gate: f32,
    open: Vec<Open>,
    /// Where every open trace is expected in the column at hand, in order, and whether it has its candidate.
    expected: Vec<f32>,
    taken: Vec<bool>,
    headings: Vec<f32>,
    closed: Vec<Trace>,
    spare: Vec<Trace>,
}

impl Linker {
    /// Joins candidates (ordered by column, then row) into traces, ordered by first column, then row.
    ///
    /// A candidate continues the trace that expected it nearest by, if that trace has no nearer candidate, within
    /// the link gate; a jump ends the trace. Short or faint traces are dropped.
    pub fn link(&mut self, candidates: &[Candidate], width_px: f32) -> &mut [Trace] {
        self.begin(width_px);
        for column in candidates.chunk_by(|a, b| a.u == b.u) {
            self.add_column(column);
        }
        self.finish();
        self.traces_mut()
    }

    /// Forgets the traces of the image before; its lines are `width_px` wide.
    pub fn begin(&mut self, width_px: f32) {
        self.gate = (LINK_GATE_WIDTHS * width_px).max(LINK_GATE_MIN_PX);
        self.spare.append(&mut self.closed);
    }

    /// Goes on with neighbouring columns from `first_u` on, if their candidates are stretches (by row) which the open
    /// traces plainly continue: in number and order, each all within the gate, and far apart. Otherwise nothing changes.
    #[inline(always)]
    pub fn add_stretches(&mut self, first_u: usize, stretches: &[Stretch]) -> bool {
        let go_on = self.open.iter().all(|open| open.next_u == first_u);
        if !go_on || stretches.len() != self.open.len() || !are_apart(stretches, 6.0 * self.gate) {
            return false;
        }
        self.headings.clear();
        for (open, stretch) in self.open.iter().zip(stretches) {
            let Some(heading) = open.heading_after(stretch, self.gate) else { return false };
            self.headings.push(heading);
        }
        for ((open, stretch), &heading) in self.open.iter_mut().zip(stretches).zip(&self.headings) {
            open.grow_by(stretch, heading);
        }
        true
    }

    /// Closes all traces and drops those that are no lines.
    pub fn finish(&mut self) {
        self.closed.extend(self.open.drain(..).map(|open| open.trace));
        let (spare, believed) = (&mut self.spare, &mut self.closed);
        let mut idx = 0;
        while idx < believed.len() {
            if believed[idx].is_believable() {
                let n = believed[idx].len();
                believed[idx].clearance_px.clear();
                believed[idx].clearance_px.resize(n, ALONE);
                idx += 1;
            } else {
                spare.push(believed.swap_remove(idx));
            }
        }
        believed.sort_unstable_by(|a, b| {
            (a.first_u, a.v[0]).partial_cmp(&(b.first_u, b.v[0])).unwrap_or(Ordering::Equal)
        });
    }

    /// The traces, by first column, then row.
    pub fn traces_mut(&mut self) -> &mut [Trace] {
        &mut self.closed
    }

    /// Goes on with the candidates of one column, by row; there is at least one.
    #[inline(always)]
    pub fn add_column(&mut self, column: &[Candidate]) {
        let (u, gate) = (column[0].u as usize, self.gate);
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
                    let trace = self.spare.pop().unwrap_or_default();
                    self.open.push(Open::begin(candidate, trace));
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
                if done.len() >= MIN_SEGMENT_COLUMNS {
                    self.closed.push(done);
                } else {
                    self.spare.push(done);
                }
            } else {
                idx += 1;
            }
        }
    }
}

/// Whether the rows of stretches, one after the other, are more than `rows` apart in every column.
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

/// Notes at every step how far the nearest other trace is that is bright enough to matter.
pub fn mark_clearances(traces: &mut [Trace]) {
    let steps = |(trace_idx, trace): (usize, &Trace)| {
        let (first_u, of_trace) = (trace.first_u, trace.v.iter().zip(&trace.contrast));
        of_trace
            .enumerate()
            .map(move |(i, (&v, &contrast))| (first_u + i, v, contrast, trace_idx))
            .collect::<Vec<_>>()
    };
    let mut all: Vec<(usize, f32, f32, usize)> = traces.iter().enumerate().flat_map(steps).collect();
    all.sort_unstable_by_key(|step| step.0);
    for (trace_idx, trace) in traces.iter_mut().enumerate() {
        for idx in 0..trace.len() {
            let (u, v, least) = (trace.first_u + idx, trace.v[idx], RIVAL_CONTRAST * trace.contrast[idx]);
            let column = all.partition_point(|step| step.0 < u)..all.partition_point(|step| step.0 <= u);
            let others = all[column].iter().filter(|other| other.3 != trace_idx && other.2 >= least);
            trace.clearance_px[idx] = others.map(|other| (other.1 - v).abs()).fold(ALONE, f32::min);
        }
    }
}
