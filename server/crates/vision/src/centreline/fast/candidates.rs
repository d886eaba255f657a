//! Candidates as the reference finds them, only where cells are bright: sixteen columns side by side.

use super::cells::Strip;
use super::spread::Difference;
use crate::centreline::reference::candidates::{Boxes, Candidate};
use crate::centreline::reference::noise::NoiseMap;
use crate::centreline::reference::segments::{Linker, STRETCH, Stretch, are_apart};
use crate::centreline::view::{Level, Sum, View};
use crate::params::{
    CANDIDATE_MIN_SNR, CANDIDATE_SEPARATION_WIDTHS, CLEARANCE_MATTERS_WIDTHS, NOISE_TILE_PX, STRIP_WIDTH_PX,
};

type Lanes<T> = [<T as Level>::Sum; STRIP_WIDTH_PX];

/// Finds candidates; keeps its memory from image to image.
#[derive(Default)]
pub struct Search<T: Level> {
    prefix: Vec<Lanes<T>>,
    response: Vec<Lanes<T>>,
    found: Found,
}

/// The candidates of one strip.
#[derive(Default)]
struct Found {
    /// By row, as long as every line has one in each column.
    stretches: Vec<Stretch>,
    /// Those of every column where that is not so.
    columns: [Vec<Candidate>; STRIP_WIDTH_PX],
    is_mixed: bool,
}

impl Found {
    fn clear(&mut self) {
        self.stretches.clear();
        self.columns.iter_mut().for_each(Vec::clear);
        self.is_mixed = false;
    }

    /// From here on candidates are kept column by column, the first of which is `u0`.
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

/// What one image is searched for.
#[derive(Clone, Copy)]
struct Sought<'a, T> {
    view: &'a View<'a, T>,
    noise: &'a NoiseMap,
    boxes: Boxes,
    separation: u32,
}

impl<T: Level> Sought<'_, T> {
    /// What is found in column `u` and row `first` + `v`.
    #[inline(always)]
    fn candidate(&self, u: usize, first: usize, v: T::Sum, response: T::Sum) -> Candidate {
        let v = (first as i32 + v.int()) as u32;
        let contrast = response.number() / self.boxes.rows() as f32;
        Candidate { u: u as u32, v, contrast, snr: contrast / self.noise.at(u, v as usize) }
    }

    /// The latest candidates of all columns from `u0` on, `rows` being those that were searched.
    #[inline(always)]
    fn stretch(&self, u0: usize, rows: &std::ops::Range<usize>, latest: &Latest<T>) -> Stretch {
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

/// The latest candidate of every column: its row in the run and its response, which is zero before there is one.
struct Latest<T: Level> {
    v: Lanes<T>,
    response: Lanes<T>,
    before: (Lanes<T>, Lanes<T>),
    separation: T::Sum,
}

impl<T: Level> Latest<T> {
    #[inline(always)]
    fn new(separation: u32) -> Self {
        let zero = [T::Sum::default(); STRIP_WIDTH_PX];
        Self { v: zero, response: zero, before: (zero, zero), separation: T::Sum::whole(separation as i32) }
    }

    /// Whether all columns have a candidate or none has; nothing if some have.
    #[inline(always)]
    fn everywhere(&self) -> Option<bool> {
        let n = self.response.iter().map(|&response| u32::from(response > T::Sum::default())).sum::<u32>();
        match n as usize {
            0 => Some(false),
            STRIP_WIDTH_PX => Some(true),
            _ => None,
        }
    }

    /// Meets the responses of a row where `lead` is not negative: of two that are too close the stronger stays. Not
    /// negative is the answer where the one before was left for good.
    #[inline(always)]
    fn meet(&mut self, lead: &Lanes<T>, response: &Lanes<T>, v: usize) -> Lanes<T> {
        let next = T::Sum::whole(v as i32 + 1).minus(self.separation);
        self.before = (self.v, self.response);
        let here = T::Sum::whole(v as i32);
        let mut done = *lead;
        for i in 0..STRIP_WIDTH_PX {
            // Negative is what is so.
            let is_far = self.v[i].minus(next);
            let is_stronger = self.response[i].minus(response[i]);
            let is_first = self.response[i].minus(T::Sum::ONE);
            let taken = is_far.or(is_stronger).or(is_first).and(lead[i].not()).sign();
            done[i] = is_far.and(is_first.not()).and(lead[i].not()).not();
            self.v[i] = here.and(taken).or(self.v[i].and(taken.not()));
            self.response[i] = response[i].and(taken).or(self.response[i].and(taken.not()));
        }
        done
    }
}

impl<T: Level> Search<T> {
    /// Finds all candidates and hands them to the linker, strip by strip. `noise` is that of box differences. Whether
    /// any two of a column are so near to each other that clearances matter.
    #[inline(always)]
    pub fn candidates(
        &mut self,
        view: &View<T>,
        noise: &NoiseMap,
        boxes: Boxes,
        width_px: f32,
        strips: &[Strip],
        linker: &mut Linker,
    ) -> bool {
        let separation = (CANDIDATE_SEPARATION_WIDTHS * width_px).max(2.0).ceil() as u32;
        let sought = Sought { view, noise, boxes, separation };
        let near = (CLEARANCE_MATTERS_WIDTHS * width_px) as u32;
        let mut crowded = false;
        for strip in strips {
            self.found.clear();
            for rows in &strip.rows {
                self.run(&sought, strip, rows.clone());
            }
            let found = &mut self.found;
            if !found.is_mixed && linker.add_stretches(strip.u0, &found.stretches) {
                crowded |= !are_apart(&found.stretches, near as f32);
                continue;
            }
            found.mix(strip.u0, separation);
            for column in found.columns.iter().filter(|column| !column.is_empty()) {
                linker.add_column(column);
                crowded |= column.array_windows().any(|[upper, lower]| lower.v - upper.v <= near);
            }
        }
        crowded
    }

    /// Looks for candidates in some rows of a strip.
    #[inline(always)]
    fn run(&mut self, sought: &Sought<T>, strip: &Strip, rows: std::ops::Range<usize>) {
        self.respond(sought, strip, &rows);
        let found = &mut self.found;
        let (mut latest, left_any) = met::<T, false>(&self.response, sought, strip.u0, &rows, found);
        match latest.everywhere() {
            Some(true) if !left_any && !found.is_mixed => {
                return found.stretches.push(sought.stretch(strip.u0, &rows, &latest));
            }
            Some(false) => return,
            _ => found.mix(strip.u0, sought.separation),
        }
        if left_any {
            (latest, _) = met::<T, true>(&self.response, sought, strip.u0, &rows, found);
        }
        for i in (0..STRIP_WIDTH_PX).filter(|&i| latest.response[i] > T::Sum::default()) {
            let last = sought.candidate(strip.u0 + i, rows.start, latest.v[i], latest.response[i]);
            keep(&mut found.columns[i], last, sought.separation);
        }
    }

    /// Box sum above the brighter flank for the rows and one beyond either end, nothing beyond the image; near the upper
    /// and lower edge the one flank inside the image counts.
    #[inline(always)]
    fn respond(&mut self, sought: &Sought<T>, strip: &Strip, rows: &std::ops::Range<usize>) {
        let Boxes { half_height: half, flank } = sought.boxes;
        let last = sought.view.height - 1;
        let (from, to) = (rows.start.saturating_sub(1), (rows.end + 1).min(last + 1));
        let top = from.saturating_sub(flank);
        let bottom = (to - 1 + flank).min(last);
        self.sum_up(sought.view, strip, top, half, bottom - top + 2 * half + 1);
        let zero = [T::Sum::default(); STRIP_WIDTH_PX];
        self.response.resize(rows.len() + 2, zero);
        self.response[0] = zero;
        self.response[rows.len() + 1] = zero;
        let responses = &mut self.response[from + 1 - rows.start..][..to - from];
        let (prefix, height) = (self.prefix.as_slice(), 2 * half + 1);
        if from >= flank && to + flank <= last + 1 {
            let sums =
                |first: usize| prefix[first + height..][..to - from].iter().zip(&prefix[first..][..to - from]);
            for (response, ((above, here), below)) in
                responses.iter_mut().zip(sums(0).zip(sums(flank)).zip(sums(2 * flank)))
            {
                *response = contrast::<T>(above, here, below);
            }
        } else {
            let boxed = |v: usize| (&prefix[v - top + height], &prefix[v - top]);
            for (response, v) in responses.iter_mut().zip(from..to) {
                let above = boxed(if v >= flank { v - flank } else { (v + flank).min(last) });
                let below = boxed(if v + flank <= last { v + flank } else { v.saturating_sub(flank) });
                *response = contrast::<T>(above, boxed(v), below);
            }
        }
    }

    /// prefix[k] is the sum of the rows before top − half + k; rows beyond the image repeat its border.
    #[inline(always)]
    fn sum_up(&mut self, view: &View<T>, strip: &Strip, top: usize, half: usize, n: usize) {
        let last = view.height - 1;
        let mut sum = [T::Sum::default(); STRIP_WIDTH_PX];
        self.prefix.resize(n + 1, sum);
        self.prefix[0] = sum;
        let (first, beyond) = (top.wrapping_sub(half), top + n - half);
        let is_whole = strip.u1 - strip.u0 == STRIP_WIDTH_PX;
        if top >= half && beyond <= last + 1 && is_whole {
            let rows = view.pixels[first * view.width..].chunks_exact(view.width);
            for (prefix, row) in self.prefix[1..].iter_mut().zip(rows) {
                let levels = &row[strip.u0..strip.u0 + STRIP_WIDTH_PX];
                for i in 0..STRIP_WIDTH_PX {
                    sum[i] = sum[i].plus(levels[i].sum());
                }
                *prefix = sum;
            }
        } else {
            for (k, prefix) in self.prefix[1..].iter_mut().enumerate() {
                let v = (top + k).saturating_sub(half).min(last);
                let row = &view.pixels[v * view.width + strip.u0..v * view.width + strip.u1];
                sum.iter_mut().zip(row).for_each(|(sum, level)| *sum = sum.plus(level.sum()));
                *prefix = sum;
            }
        }
    }
}

/// The latest candidates when all rows of a run have been met, and whether any before them was left for good: then
/// those are kept in `found` if `KEEPING`.
#[inline(always)]
fn met<T: Level, const KEEPING: bool>(
    response: &[Lanes<T>],
    sought: &Sought<T>,
    u0: usize,
    rows: &std::ops::Range<usize>,
    found: &mut Found,
) -> (Latest<T>, bool) {
    let first = rows.start;
    let mut latest = Latest::<T>::new(sought.separation);
    // Negative in columns in which nothing was left.
    let mut left = [T::Sum::ONE.not(); STRIP_WIDTH_PX];
    let mut rest = rows.clone();
    while !rest.is_empty() {
        let tile_end = ((rest.start / NOISE_TILE_PX + 1) * NOISE_TILE_PX).min(rest.end);
        let sum_sigma = sought.noise.at(u0, rest.start) * sought.boxes.rows() as f32;
        let threshold = T::Sum::nearest((CANDIDATE_MIN_SNR * sum_sigma).ceil());
        let three = &response[rest.start - first..tile_end + 2 - first];
        // A bit for every row in which any column leads: which rows do is hard to foretell, so nothing branches on it.
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
            let done = latest.meet(&lead, here, rest.start - first + k);
            for i in 0..STRIP_WIDTH_PX {
                left[i] = left[i].and(done[i]);
            }
            if KEEPING && any_from_zero::<T>(&done) {
                for i in (0..STRIP_WIDTH_PX).filter(|&i| done[i] >= T::Sum::default()) {
                    let (v, response) = (latest.before.0[i], latest.before.1[i]);
                    keep(&mut found.columns[i], sought.candidate(u0 + i, first, v, response), sought.separation);
                }
            }
        }
        rest.start = tile_end;
    }
    (latest, any_from_zero::<T>(&left))
}

/// A box above the brighter of two others, each given by the running sums behind and before it.
#[inline(always)]
fn contrast<T: Level>(
    above: (&Lanes<T>, &Lanes<T>),
    here: (&Lanes<T>, &Lanes<T>),
    below: (&Lanes<T>, &Lanes<T>),
) -> Lanes<T> {
    let mut contrast = *here.0;
    for i in 0..STRIP_WIDTH_PX {
        let flank = above.0[i].minus(above.1[i]).max(below.0[i].minus(below.1[i]));
        contrast[i] = here.0[i].minus(here.1[i]).minus(flank);
    }
    contrast
}

/// Whether any lane is not negative.
#[inline(always)]
fn any_from_zero<T: Level>(lanes: &Lanes<T>) -> bool {
    lanes.iter().fold(false, |any, &lane| any | (lane >= T::Sum::default()))
}

/// By how much every lane is at least the threshold, more than the row before and at least the row after; negative where
/// it is not.
#[inline(always)]
fn lead<T: Level>(before: &Lanes<T>, here: &Lanes<T>, after: &Lanes<T>, threshold: T::Sum) -> Lanes<T> {
    let mut lead = *here;
    for i in 0..STRIP_WIDTH_PX {
        let over_rows = here[i].minus(before[i]).minus(T::Sum::ONE).min(here[i].minus(after[i]));
        lead[i] = here[i].minus(threshold).min(over_rows);
    }
    lead
}

/// Adds a candidate to its column, or lets the stronger of two that are too close stay.
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
