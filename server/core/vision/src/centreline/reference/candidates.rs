//! Where lines may be: local maxima of a box that stands out from both its flanks.

use super::noise::NoiseMap;
use crate::centreline::view::{Level, View};
use crate::params::{
    BOX_HEIGHT_WIDTHS, CANDIDATE_MIN_SNR, CANDIDATE_SEPARATION_WIDTHS, FLANK_DISTANCE_WIDTHS, NOISE_TILE_PX,
};

/// A place where a column may cross a line.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Column.
    pub u: u32,
    /// Row.
    pub v: u32,
    /// Mean grey level of the box above its brighter flank.
    pub contrast: f32,
    /// Contrast over its standard deviation.
    pub snr: f32,
}

/// The boxes compared while looking for lines.
#[derive(Debug, Clone, Copy)]
pub struct Boxes {
    /// Half-height of a box: it covers `2 * half_height + 1` rows.
    pub half_height: usize,
    /// Rows from the middle of a box to the middle of either flank.
    pub flank: usize,
}

impl Boxes {
    /// Boxes fit for lines of this full width at half height.
    pub fn for_width(width_px: f32) -> Self {
        let half_height = (0.5 * BOX_HEIGHT_WIDTHS * width_px).round().max(1.0) as usize;
        let flank = (FLANK_DISTANCE_WIDTHS * width_px).ceil() as usize + 1;
        Self { half_height, flank }
    }

    /// Rows in a box.
    pub fn rows(&self) -> usize {
        2 * self.half_height + 1
    }
}

/// Box sums centred on every row, kept for as many rows as one comparison needs.
struct SumRows {
    ring: Vec<Vec<i32>>,
}

impl SumRows {
    fn row(&self, v: usize) -> &[i32] {
        &self.ring[v % self.ring.len()]
    }

    /// Fills row `v` of the ring from row `v − 1`: one row enters the box, one leaves. Beyond the image
    /// the outermost row is repeated.
    fn advance<T: Level>(&mut self, view: &View<T>, v: usize, half_height: usize) {
        let n = self.ring.len();
        let mut sums = std::mem::take(&mut self.ring[v % n]);
        let last = view.height - 1;
        let clamped = |v: isize| view.row(v.clamp(0, last as isize) as usize);
        let half = half_height as isize;
        if v == 0 {
            sums.fill(0);
            for k in -half..=half {
                sums.iter_mut().zip(clamped(k)).for_each(|(sum, level)| *sum += level.int());
            }
        } else {
            let before = &self.ring[(v - 1) % n];
            let (enters, leaves) = (clamped(v as isize + half), clamped(v as isize - half - 1));
            for (((sum, &old), add), sub) in sums.iter_mut().zip(before).zip(enters).zip(leaves) {
                *sum = old + add.int() - sub.int();
            }
        }
        self.ring[v % n] = sums;
    }
}

/// Finds all candidates, ordered by column, then by row. `noise` is that of box differences.
///
/// A candidate is a row whose box sum exceeds the *brighter* of its two flanks by
/// [`CANDIDATE_MIN_SNR`] standard deviations and is a local maximum of that difference: an edge of ambient
/// light is as bright as one flank and gives nothing.
pub fn find_candidates<T: Level>(view: &View<T>, noise: &NoiseMap, boxes: Boxes, width_px: f32) -> Vec<Candidate> {
    let mut sums = SumRows { ring: vec![vec![0i32; view.width]; 2 * boxes.flank + 2] };
    let mut responses = vec![vec![0i32; view.width]; 3];
    let mut found = Vec::new();
    let last = view.height - 1;
    (0..=boxes.flank.min(last)).for_each(|v| sums.advance(view, v, boxes.half_height));
    for v in 0..view.height + 1 {
        if v > 0 && v + boxes.flank <= last {
            sums.advance(view, v + boxes.flank, boxes.half_height);
        }
        if v <= last {
            respond(&sums, v, boxes.flank, last, &mut responses[v % 3]);
        } else {
            responses[v % 3].fill(0);
        }
        if v >= 1 {
            let [before, here, after] = [(v + 1) % 3, (v + 2) % 3, v % 3].map(|i| responses[i].as_slice());
            pick_maxima(before, here, after, v - 1, noise, boxes, &mut found);
        }
    }
    found.sort_unstable_by_key(|c| (c.u, c.v));
    thinned(&found, (CANDIDATE_SEPARATION_WIDTHS * width_px).max(2.0))
}

/// Box sum above the brighter flank; near the upper and lower edge the one flank inside the image counts.
fn respond(sums: &SumRows, v: usize, flank: usize, last: usize, response: &mut [i32]) {
    let above = sums.row(if v >= flank { v - flank } else { (v + flank).min(last) });
    let below = sums.row(if v + flank <= last { v + flank } else { v.saturating_sub(flank) });
    for (((out, &box_sum), &a), &b) in response.iter_mut().zip(sums.row(v)).zip(above).zip(below) {
        *out = box_sum - a.max(b);
    }
}

fn pick_maxima(
    before: &[i32],
    here: &[i32],
    after: &[i32],
    v: usize,
    noise: &NoiseMap,
    boxes: Boxes,
    found: &mut Vec<Candidate>,
) {
    let n_rows = boxes.rows() as f32;
    for (tile, &sigma) in noise.row(v).iter().enumerate() {
        let sum_sigma = sigma * n_rows;
        let threshold = (CANDIDATE_MIN_SNR * sum_sigma).ceil() as i32;
        let start = tile * NOISE_TILE_PX;
        let end = (start + NOISE_TILE_PX).min(here.len());
        for (offset, &response) in here[start..end].iter().enumerate() {
            let u = start + offset;
            if response >= threshold && response > before[u] && response >= after[u] {
                let contrast = response as f32 / n_rows;
                found.push(Candidate { u: u as u32, v: v as u32, contrast, snr: response as f32 / sum_sigma });
            }
        }
    }
}

/// Keeps the strongest of candidates closer to each other than `separation_px` in one column.
fn thinned(found: &[Candidate], separation_px: f32) -> Vec<Candidate> {
    let mut kept: Vec<Candidate> = Vec::with_capacity(found.len());
    for &candidate in found {
        match kept.last_mut() {
            Some(last) if last.u == candidate.u && ((candidate.v - last.v) as f32) < separation_px => {
                if candidate.contrast > last.contrast {
                    *last = candidate;
                }
            }
            _ => kept.push(candidate),
        }
    }
    kept
}
