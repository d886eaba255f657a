//! Candidates as the reference finds them, only where cells are bright: eight columns side by side.

use super::cells::Strip;
use crate::centreline::reference::candidates::{Boxes, Candidate};
use crate::centreline::reference::noise::NoiseMap;
use crate::centreline::view::{Level, View};
use crate::params::{CANDIDATE_MIN_SNR, CANDIDATE_SEPARATION_WIDTHS, CELL_WIDTH_PX, NOISE_TILE_PX};

type Lanes = [i32; CELL_WIDTH_PX];

/// Finds all candidates, ordered by column, then by row. `noise` is that of box differences.
#[inline(always)]
pub fn find_candidates<T: Level>(
    view: &View<T>,
    noise: &NoiseMap,
    boxes: Boxes,
    width_px: f32,
    strips: &[Strip],
) -> Vec<Candidate> {
    let separation_px = (CANDIDATE_SEPARATION_WIDTHS * width_px).max(2.0);
    let mut search = Search { view, noise, boxes, prefix: Vec::new(), response: Vec::new() };
    let mut columns: [Vec<Candidate>; CELL_WIDTH_PX] = std::array::from_fn(|_| Vec::with_capacity(64));
    let mut found = Vec::with_capacity(8 * view.width);
    for strip in strips {
        for rows in &strip.rows {
            search.strip(strip, rows.clone(), separation_px, &mut columns);
        }
        for column in &mut columns {
            found.append(column);
        }
    }
    found
}

/// What one comparison after the other needs.
struct Search<'a, T> {
    view: &'a View<'a, T>,
    noise: &'a NoiseMap,
    boxes: Boxes,
    prefix: Vec<Lanes>,
    response: Vec<Lanes>,
}

impl<T: Level> Search<'_, T> {
    #[inline(always)]
    fn strip(
        &mut self,
        strip: &Strip,
        rows: std::ops::Range<usize>,
        separation_px: f32,
        columns: &mut [Vec<Candidate>; CELL_WIDTH_PX],
    ) {
        let last = self.view.height - 1;
        // Responses of the rows and of one beyond either end.
        let (from, to) = (rows.start.saturating_sub(1), (rows.end + 1).min(last + 1));
        self.respond(strip, from, to);
        let zero = [0; CELL_WIDTH_PX];
        let n_rows = self.boxes.rows() as f32;
        let (mut tile, mut sum_sigma, mut threshold) = (usize::MAX, 0.0f32, 0i32);
        for v in rows {
            if v / NOISE_TILE_PX != tile {
                tile = v / NOISE_TILE_PX;
                sum_sigma = self.noise.at(strip.u0, v) * n_rows;
                threshold = (CANDIDATE_MIN_SNR * sum_sigma).ceil() as i32;
            }
            let before = if v > from { &self.response[v - 1 - from] } else { &zero };
            let after = if v + 1 < to { &self.response[v + 1 - from] } else { &zero };
            let here = &self.response[v - from];
            let hits: Lanes = std::array::from_fn(|i| {
                i32::from((here[i] >= threshold) & (here[i] > before[i]) & (here[i] >= after[i]))
            });
            if hits.iter().fold(0, |any, hit| any | hit) == 0 {
                continue;
            }
            for i in (0..strip.u1 - strip.u0).filter(|&i| hits[i] != 0) {
                let (u, response) = ((strip.u0 + i) as u32, here[i] as f32);
                let candidate =
                    Candidate { u, v: v as u32, contrast: response / n_rows, snr: response / sum_sigma };
                keep(&mut columns[i], candidate, separation_px);
            }
        }
    }

    /// Box sum above the brighter flank for rows `from .. to`; near the upper and lower edge the one flank inside
    /// the image counts.
    #[inline(always)]
    fn respond(&mut self, strip: &Strip, from: usize, to: usize) {
        let Boxes { half_height: half, flank } = self.boxes;
        let last = self.view.height - 1;
        let top = from.saturating_sub(flank);
        let bottom = (to - 1 + flank).min(last);
        // prefix[k] is the sum of the rows before top − half + k.
        let n = bottom - top + 2 * half + 1;
        self.prefix.resize(n + 1, [0; CELL_WIDTH_PX]);
        let mut sum = [0i32; CELL_WIDTH_PX];
        for (k, prefix) in self.prefix[..=n].iter_mut().enumerate() {
            *prefix = sum;
            let v = (top + k).saturating_sub(half).min(last);
            let row = &self.view.pixels[v * self.view.width + strip.u0..];
            match row.first_chunk::<CELL_WIDTH_PX>() {
                Some(levels) => (0..CELL_WIDTH_PX).for_each(|i| sum[i] += levels[i].int()),
                None => sum.iter_mut().zip(row).for_each(|(sum, level)| *sum += level.int()),
            }
        }
        let prefix = self.prefix.as_slice();
        let boxed = |v: usize| -> Lanes {
            let (upto, before) = (&prefix[v - top + 2 * half + 1], &prefix[v - top]);
            std::array::from_fn(|i| upto[i] - before[i])
        };
        self.response.resize(to - from, [0; CELL_WIDTH_PX]);
        for (response, v) in self.response.iter_mut().zip(from..to) {
            let above = boxed(if v >= flank { v - flank } else { (v + flank).min(last) });
            let below = boxed(if v + flank <= last { v + flank } else { v.saturating_sub(flank) });
            let here = boxed(v);
            *response = std::array::from_fn(|i| here[i] - above[i].max(below[i]));
        }
    }
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
