//! Candidates as the reference finds them, only where cells are bright: sixteen columns side by side.

use super::cells::Strip;
use crate::centreline::reference::candidates::{Boxes, Candidate};
use crate::centreline::reference::noise::NoiseMap;
use crate::centreline::view::{Level, Sum, View};
use crate::params::{CANDIDATE_MIN_SNR, CANDIDATE_SEPARATION_WIDTHS, NOISE_TILE_PX, STRIP_WIDTH_PX};

type Lanes<T> = [<T as Level>::Sum; STRIP_WIDTH_PX];

/// Finds candidates; keeps its memory from image to image.
#[derive(Default)]
pub struct Search<T: Level> {
    prefix: Vec<Lanes<T>>,
    response: Vec<Lanes<T>>,
    /// The candidates of every column: row and response.
    columns: [Vec<(u32, T::Sum)>; STRIP_WIDTH_PX],
}

/// What one image is searched for.
#[derive(Clone, Copy)]
struct Sought<'a, T> {
    view: &'a View<'a, T>,
    noise: &'a NoiseMap,
    boxes: Boxes,
    separation: u32,
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
    /// Finds all candidates, ordered by column, then by row. `noise` is that of box differences.
    #[inline(always)]
    pub fn candidates(
        &mut self,
        view: &View<T>,
        noise: &NoiseMap,
        boxes: Boxes,
        width_px: f32,
        strips: &[Strip],
        found: &mut Vec<Candidate>,
    ) {
        let separation = (CANDIDATE_SEPARATION_WIDTHS * width_px).max(2.0).ceil() as u32;
        let sought = Sought { view, noise, boxes, separation };
        found.clear();
        for strip in strips {
            for rows in &strip.rows {
                self.strip(&sought, strip, rows.clone());
            }
            for (u, column) in (strip.u0..).zip(&mut self.columns) {
                for &(v, response) in &*column {
                    let contrast = response.number() / boxes.rows() as f32;
                    let snr = contrast / noise.at(strip.u0, v as usize);
                    found.push(Candidate { u: u as u32, v, contrast, snr });
                }
                column.clear();
            }
        }
    }

    #[inline(always)]
    fn strip(&mut self, sought: &Sought<T>, strip: &Strip, rows: std::ops::Range<usize>) {
        self.respond(sought, strip, &rows);
        let first = rows.start;
        let mut latest = Latest::<T>::new(sought.separation);
        let mut rest = rows;
        while !rest.is_empty() {
            let tile_end = ((rest.start / NOISE_TILE_PX + 1) * NOISE_TILE_PX).min(rest.end);
            let sum_sigma = sought.noise.at(strip.u0, rest.start) * sought.boxes.rows() as f32;
            let threshold = T::Sum::nearest((CANDIDATE_MIN_SNR * sum_sigma).ceil());
            let three = &self.response[rest.start - first..tile_end + 2 - first];
            let nexts = three.iter().zip(&three[1..]).zip(&three[2..]);
            for (v, ((before, here), after)) in (rest.start - first..).zip(nexts) {
                let lead = lead::<T>(before, here, after, threshold);
                if !any_from_zero::<T>(&lead) {
                    continue;
                }
                let done = latest.meet(&lead, here, v);
                if !any_from_zero::<T>(&done) {
                    continue;
                }
                for i in (0..STRIP_WIDTH_PX).filter(|&i| done[i] >= T::Sum::default()) {
                    let v = (first as i32 + latest.before.0[i].int()) as u32;
                    keep::<T>(&mut self.columns[i], v, latest.before.1[i], sought.separation);
                }
            }
            rest.start = tile_end;
        }
        for i in 0..strip.u1 - strip.u0 {
            if latest.response[i] > T::Sum::default() {
                let v = (first as i32 + latest.v[i].int()) as u32;
                keep::<T>(&mut self.columns[i], v, latest.response[i], sought.separation);
            }
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
    let most = lanes.iter().fold(T::Sum::default().minus(T::Sum::ONE), |most, &lane| most.max(lane));
    most >= T::Sum::default()
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
fn keep<T: Level>(column: &mut Vec<(u32, T::Sum)>, v: u32, response: T::Sum, separation: u32) {
    match column.last_mut() {
        Some(last) if v - last.0 < separation => {
            if response > last.1 {
                *last = (v, response);
            }
        }
        _ => column.push((v, response)),
    }
}
