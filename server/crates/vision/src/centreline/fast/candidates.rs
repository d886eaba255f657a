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
    columns: [Vec<Candidate>; STRIP_WIDTH_PX],
}

/// What one image is searched for.
#[derive(Clone, Copy)]
struct Sought<'a, T> {
    view: &'a View<'a, T>,
    noise: &'a NoiseMap,
    boxes: Boxes,
    separation_px: f32,
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
        let separation_px = (CANDIDATE_SEPARATION_WIDTHS * width_px).max(2.0);
        let sought = Sought { view, noise, boxes, separation_px };
        found.clear();
        for strip in strips {
            for rows in &strip.rows {
                self.strip(&sought, strip, rows.clone());
            }
            for column in &mut self.columns {
                found.append(column);
            }
        }
    }

    #[inline(always)]
    fn strip(&mut self, sought: &Sought<T>, strip: &Strip, rows: std::ops::Range<usize>) {
        self.respond(sought, strip, &rows);
        let n_rows = sought.boxes.rows() as f32;
        let n_columns = strip.u1 - strip.u0;
        let first = rows.start;
        let mut rest = rows;
        while !rest.is_empty() {
            let tile_end = ((rest.start / NOISE_TILE_PX + 1) * NOISE_TILE_PX).min(rest.end);
            let sum_sigma = sought.noise.at(strip.u0, rest.start) * n_rows;
            let threshold = T::Sum::nearest((CANDIDATE_MIN_SNR * sum_sigma).ceil());
            let three = &self.response[rest.start - first..tile_end + 2 - first];
            let nexts = three.iter().zip(&three[1..]).zip(&three[2..]);
            for (v, ((before, here), after)) in (rest.start..tile_end).zip(nexts) {
                let lead = lead::<T>(before, here, after, threshold);
                if lead.iter().fold(T::Sum::default().minus(T::Sum::ONE), |most, &lead| most.max(lead))
                    < T::Sum::default()
                {
                    continue;
                }
                for i in (0..n_columns).filter(|&i| lead[i] >= T::Sum::default()) {
                    let response = here[i].number();
                    let (contrast, snr) = (response / n_rows, response / sum_sigma);
                    let candidate = Candidate { u: (strip.u0 + i) as u32, v: v as u32, contrast, snr };
                    keep(&mut self.columns[i], candidate, sought.separation_px);
                }
            }
            rest.start = tile_end;
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
            let rows = view.pixels[first * view.width + strip.u0..].chunks(view.width);
            for (prefix, row) in self.prefix[1..].iter_mut().zip(rows) {
                let levels: &[T; STRIP_WIDTH_PX] = row.first_chunk().expect("a whole strip lies in every row");
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
fn keep(column: &mut Vec<Candidate>, candidate: Candidate, separation_px: f32) {
    match column.last_mut() {
        Some(last) if ((candidate.v - last.v) as f32) < separation_px => {
            if candidate.contrast > last.contrast {
                *last = candidate;
            }
        }
        _ => column.push(candidate),
    }
}
