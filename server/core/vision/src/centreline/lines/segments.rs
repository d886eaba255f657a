//! Candidates linked, column by column, into traces of one line each.

use std::cmp::Ordering;

use super::candidates::Candidate;
use super::traces::{NO_NEIGHBOUR, Open, Stretch, Trace, are_apart};
use crate::params::{LINK_GATE_MIN_PX, LINK_GATE_WIDTHS, LINK_MAX_GAP_COLUMNS, MIN_SEGMENT_COLUMNS};

/// Links candidates into traces; its memory is reused from image to image.
#[derive(Default)]
pub struct Linker {
    /// Largest distance, in rows, of a candidate from a trace's expected row.
    gate: f32,
    open: Vec<Open>,
    /// Expected row of every open trace in the current column, in order, and whether it has its candidate.
    expected: Vec<f32>,
    taken: Vec<bool>,
    headings: Vec<f32>,
    closed: Vec<Trace>,
    spare: Vec<Trace>,
}

impl Linker {
    /// Clears the traces of the previous image; the lines of the next are `width_px` wide.
    pub fn begin(&mut self, width_px: f32) {
        self.gate = (LINK_GATE_WIDTHS * width_px).max(LINK_GATE_MIN_PX);
        self.spare.append(&mut self.closed);
    }

    /// Continues with neighbouring columns from `first_u` on, if their candidates are stretches (by row) that clearly
    /// continue the open traces: equal in number and order, each within the gate, and far apart. Otherwise nothing
    /// changes and the result is false.
    #[inline(always)]
    pub fn add_stretches(&mut self, first_u: usize, stretches: &[Stretch]) -> bool {
        let are_continued = self.open.iter().all(|open| open.next_u == first_u);
        if !are_continued || stretches.len() != self.open.len() || !are_apart(stretches, 6.0 * self.gate) {
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

    /// Closes all traces and drops those that are not lines.
    pub fn finish(&mut self) {
        self.closed.extend(self.open.drain(..).map(|open| open.trace));
        let (spare, significant) = (&mut self.spare, &mut self.closed);
        let mut idx = 0;
        while idx < significant.len() {
            if significant[idx].is_significant() {
                let n = significant[idx].len();
                significant[idx].clearance_px.clear();
                significant[idx].clearance_px.resize(n, NO_NEIGHBOUR);
                idx += 1;
            } else {
                spare.push(significant.swap_remove(idx));
            }
        }
        significant.sort_unstable_by(|a, b| {
            (a.first_u, a.v[0]).partial_cmp(&(b.first_u, b.v[0])).unwrap_or(Ordering::Equal)
        });
    }

    /// The traces, by first column, then row.
    pub fn traces_mut(&mut self) -> &mut [Trace] {
        &mut self.closed
    }

    /// Continues with the candidates of one column, by row; there is at least one.
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

    /// Computes the expected row of every open trace in column `u`, in this order.
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

    /// Whether every trace continues with exactly one candidate within the gate and all are so far apart that no other
    /// candidate competes.
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

    /// The trace that candidate `idx` of a column continues: the nearest to it, if no other candidate of the column is
    /// nearer to that trace. The search starts at `near`; where that trace has its candidate, its neighbours are tried.
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

#[cfg(test)]
mod tests {
    use super::super::traces::STRETCH;
    use super::*;

    const WIDTH_PX: f32 = 6.0;
    const N_STRETCHES: usize = 12;

    /// Three lines that vary by a row; the second jumps by `leap` rows in the middle of a stretch.
    fn stretches(leap: f32) -> Vec<[Stretch; 3]> {
        let mut state = 5u32;
        let mut waver = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 31) as f32
        };
        let mut line = |idx: usize, first: usize| {
            let leapt = |u: usize| if idx == 1 && u >= 5 * STRETCH + 7 { leap } else { 0.0 };
            let v = |u: usize| 100.0 * (idx + 1) as f32 + (u as f32 * 0.3).round() + leapt(u) + waver();
            let v: Vec<f32> = (first..first + STRETCH).map(v).collect();
            Stretch {
                v: v.try_into().expect("as many"),
                contrast: [20.0 + idx as f32; STRETCH],
                snr: [9.0; STRETCH],
            }
        };
        (0..N_STRETCHES).map(|n| [0, 1, 2].map(|idx| line(idx, n * STRETCH))).collect()
    }

    fn add_columns(linker: &mut Linker, first_u: usize, stretches: &[Stretch]) {
        for i in 0..STRETCH {
            let candidate = |stretch: &Stretch| Candidate {
                u: (first_u + i) as u32,
                v: stretch.v[i] as u32,
                contrast: stretch.contrast[i],
                snr: stretch.snr[i],
            };
            linker.add_column(&stretches.iter().map(candidate).collect::<Vec<_>>());
        }
    }

    /// The traces made from stretches, and how many stretches were added whole.
    fn linked(stretches: &[[Stretch; 3]], as_they_are: bool) -> (Vec<Trace>, usize) {
        let (mut linker, mut n_as_they_are) = (Linker::default(), 0);
        linker.begin(WIDTH_PX);
        for (n, some) in stretches.iter().enumerate() {
            if as_they_are && linker.add_stretches(n * STRETCH, some) {
                n_as_they_are += 1;
            } else {
                add_columns(&mut linker, n * STRETCH, some);
            }
        }
        linker.finish();
        (linker.traces_mut().to_vec(), n_as_they_are)
    }

    #[test]
    fn stretches_and_columns_make_the_same_traces() {
        // Where a line jumps, a new trace begins, and columns are added one by one until the old trace is closed.
        for (leap, n_traces, n_plain) in [(0.0, 3, N_STRETCHES - 1), (40.0, 4, N_STRETCHES - 2)] {
            let stretches = stretches(leap);
            let (by_columns, _) = linked(&stretches, false);
            let (by_stretches, n) = linked(&stretches, true);
            assert_eq!(by_columns.len(), n_traces);
            assert!((n_plain - 2..=n_plain).contains(&n), "{n} of {N_STRETCHES} were added as they are");
            for (one, other) in by_columns.iter().zip(&by_stretches) {
                assert_eq!((one.first_u, &one.v, &one.contrast), (other.first_u, &other.v, &other.contrast));
                assert_eq!(one.is_significant(), other.is_significant());
            }
            assert_eq!(by_columns.len(), by_stretches.len());
        }
    }
}
