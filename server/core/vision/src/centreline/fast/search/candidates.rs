//! Rows whose box is brighter than both flanks, searched in bright cells only, sixteen columns side by side. An edge of
//! ambient light is no brighter than one of its flanks and gives no candidate.

use std::ops::Range;

use super::cells::Strip;
use super::latest::{Latest, any_from_zero, lead};
use super::responses::{Lanes, Responses};
use crate::centreline::lines::candidates::{Boxes, Candidate};
use crate::centreline::lines::noise::NoiseMap;
use crate::centreline::lines::segments::Linker;
use crate::centreline::lines::traces::{STRETCH, Stretch, are_apart};
use crate::centreline::view::{Level, Sum, View};
use crate::params::{
    CANDIDATE_MIN_SNR, CANDIDATE_SEPARATION_WIDTHS, CLEARANCE_MATTERS_WIDTHS, NOISE_TILE_PX, STRIP_WIDTH_PX,
};

/// Finds candidates; its memory is reused from image to image.
#[derive(Default)]
pub struct Search<T: Level> {
    responses: Responses<T>,
    found: Found,
    crowded: Vec<Range<usize>>,
}

/// The candidates of one strip.
#[derive(Default)]
struct Found {
    /// By row, as long as every line has one candidate in each column.
    stretches: Vec<Stretch>,
    /// Candidates column by column, where that does not hold.
    columns: [Vec<Candidate>; STRIP_WIDTH_PX],
    is_mixed: bool,
}

impl Found {
    fn clear(&mut self) {
        self.stretches.clear();
        self.columns.iter_mut().for_each(Vec::clear);
        self.is_mixed = false;
    }

    /// Switches to candidates kept column by column; the first column is `u0`.
    fn mix(&mut self, u0: usize, separation: u32) {
        if std::mem::replace(&mut self.is_mixed, true) {
            return;
        }
        for Stretch { v, contrast, snr } in self.stretches.drain(..) {
            for (i, column) in self.columns.iter_mut().enumerate() {
                let u = (u0 + i) as u32;
                let candidate = Candidate { u, v: v[i] as u32, contrast: contrast[i], snr: snr[i] };
                keep(column, candidate, separation);
            }
        }
    }
}

/// Inputs of the search of one image.
#[derive(Clone, Copy)]
struct SearchInput<'a, T> {
    view: &'a View<'a, T>,
    noise: &'a NoiseMap,
    boxes: Boxes,
    separation: u32,
}

impl<T: Level> SearchInput<'_, T> {
    /// The candidate at column `u` and row `first` + `v`.
    #[inline(always)]
    fn candidate(&self, u: usize, first: usize, v: T::Sum, response: T::Sum) -> Candidate {
        let v = (first as i32 + v.int()) as u32;
        let contrast = response.number() / self.boxes.rows() as f32;
        Candidate { u: u as u32, v, contrast, snr: contrast / self.noise.at(u, v as usize) }
    }

    /// The latest candidates of all columns from `u0` on; `rows` are the rows that were searched.
    #[inline(always)]
    fn stretch(&self, u0: usize, rows: &Range<usize>, latest: &Latest<T>) -> Stretch {
        let n_rows = self.boxes.rows() as f32;
        let mut stretch = Stretch { v: [0.0; STRETCH], contrast: [0.0; STRETCH], snr: [0.0; STRETCH] };
        let mut sigmas = [self.noise.at(u0, rows.start); STRETCH];
        for i in 0..STRETCH {
            stretch.v[i] = rows.start as i32 as f32 + latest.v[i].number();
            stretch.contrast[i] = latest.response[i].number() / n_rows;
        }
        if rows.start / NOISE_TILE_PX != (rows.end - 1) / NOISE_TILE_PX {
            for i in 0..STRETCH {
                sigmas[i] = self.noise.at(u0, stretch.v[i] as usize);
            }
        }
        for i in 0..STRETCH {
            stretch.snr[i] = stretch.contrast[i] / sigmas[i];
        }
        stretch
    }
}

impl<T: Level> Search<T> {
    /// Finds all candidates and passes them to the linker, strip by strip. `noise` is that of box differences.
    #[inline(always)]
    pub fn candidates(
        &mut self,
        view: &View<T>,
        noise: &NoiseMap,
        boxes: Boxes,
        width_px: f32,
        strips: &[Strip],
        linker: &mut Linker,
    ) {
        let separation = (CANDIDATE_SEPARATION_WIDTHS * width_px).max(2.0).ceil() as u32;
        let input = SearchInput { view, noise, boxes, separation };
        let near = (CLEARANCE_MATTERS_WIDTHS * width_px) as u32;
        self.crowded.clear();
        for strip in strips {
            self.found.clear();
            for rows in &strip.rows {
                self.run(&input, strip, rows.clone());
            }
            let found = &mut self.found;
            let mut is_crowded = false;
            if !found.is_mixed && linker.add_stretches(strip.u0, &found.stretches) {
                is_crowded = !are_apart(&found.stretches, near as f32);
            } else {
                found.mix(strip.u0, separation);
                for column in found.columns.iter().filter(|column| !column.is_empty()) {
                    linker.add_column(column);
                    for [upper, lower] in column.array_windows() {
                        is_crowded |= lower.v - upper.v <= near;
                    }
                }
            }
            if is_crowded {
                match self.crowded.last_mut() {
                    Some(last) if last.end == strip.u0 => last.end = strip.u1,
                    _ => self.crowded.push(strip.u0..strip.u1),
                }
            }
        }
    }

    /// Columns in which candidates are so close to each other that clearances matter.
    pub fn crowded(&self) -> &[Range<usize>] {
        &self.crowded
    }

    /// Searches some rows of a strip for candidates.
    #[inline(always)]
    fn run(&mut self, input: &SearchInput<T>, strip: &Strip, rows: Range<usize>) {
        self.responses.find(input.view, input.boxes, strip, &rows);
        let found = &mut self.found;
        let (mut latest, left_any) = search_run::<T, false>(self.responses.rows(), input, strip.u0, &rows, found);
        match latest.everywhere() {
            Some(true) if !left_any && !found.is_mixed => {
                return found.stretches.push(input.stretch(strip.u0, &rows, &latest));
            }
            Some(false) => return,
            _ => found.mix(strip.u0, input.separation),
        }
        if left_any {
            (latest, _) = search_run::<T, true>(self.responses.rows(), input, strip.u0, &rows, found);
        }
        for i in (0..STRIP_WIDTH_PX).filter(|&i| latest.response[i] > T::Sum::default()) {
            let last = input.candidate(strip.u0 + i, rows.start, latest.v[i], latest.response[i]);
            keep(&mut found.columns[i], last, input.separation);
        }
    }
}

/// The latest candidates after all rows of a run, and whether any earlier candidate became final; final candidates are
/// stored in `found` if `KEEPING`.
#[inline(always)]
fn search_run<T: Level, const KEEPING: bool>(
    response: &[Lanes<T>],
    input: &SearchInput<T>,
    u0: usize,
    rows: &Range<usize>,
    found: &mut Found,
) -> (Latest<T>, bool) {
    let first = rows.start;
    let mut latest = Latest::<T>::new(input.separation);
    // Negative in columns in which no candidate became final.
    let mut left = [T::Sum::ONE.not(); STRIP_WIDTH_PX];
    let mut rest = rows.clone();
    while !rest.is_empty() {
        let tile_end = ((rest.start / NOISE_TILE_PX + 1) * NOISE_TILE_PX).min(rest.end);
        let sum_sigma = input.noise.at(u0, rest.start) * input.boxes.rows() as f32;
        let threshold = T::Sum::nearest((CANDIDATE_MIN_SNR * sum_sigma).ceil());
        let three = &response[rest.start - first..tile_end + 2 - first];
        // One bit per row in which any column has a local maximum: such rows are hard to predict, so no branch depends
        // on them.
        let (mut leading, mut bit) = (0u64, 1);
        for [before, here, after] in three.array_windows() {
            let lead = lead::<T>(before, here, after, threshold);
            leading |= if any_from_zero::<T>(&lead) { bit } else { 0 };
            bit <<= 1;
        }
        while leading != 0 {
            let k = leading.trailing_zeros() as usize;
            leading &= leading - 1;
            let here = &three[k + 1];
            let lead = lead::<T>(&three[k], here, &three[k + 2], threshold);
            let done = latest.push_row(&lead, here, rest.start - first + k);
            for i in 0..STRIP_WIDTH_PX {
                left[i] = left[i].and(done[i]);
            }
            if KEEPING && any_from_zero::<T>(&done) {
                for i in (0..STRIP_WIDTH_PX).filter(|&i| done[i] >= T::Sum::default()) {
                    let (v, response) = (latest.before.0[i], latest.before.1[i]);
                    keep(&mut found.columns[i], input.candidate(u0 + i, first, v, response), input.separation);
                }
            }
        }
        rest.start = tile_end;
    }
    (latest, any_from_zero::<T>(&left))
}

/// Appends a candidate to its column; of two that are too close the stronger is kept.
#[inline(always)]
fn keep(column: &mut Vec<Candidate>, candidate: Candidate, separation: u32) {
    match column.last_mut() {
        Some(last) if candidate.v - last.v < separation => {
            if candidate.contrast > last.contrast {
                *last = candidate;
            }
        }
        _ => column.push(candidate),
    }
}
