//! The pieces that the lines of one frame are cut into at kinks.
//!
//! The same cuts as those of [`super::super::pieces`], found several points at a time.

use super::super::pieces::{self, Piece};
use super::lines::Lines;
use super::smooth::QuickLook;
use crate::params::{
    CUT_TRIM_POINTS, KINK_SIGMAS, KINK_SLOPE, KINK_SPAN_PX, KINK_STEP_PX, MIN_PIECE_POINTS, STEP_LIMITS,
};

/// Points that are looked at together for cuts: the bytes of one machine word.
const TOGETHER: usize = 8;

/// Memory of the search for kinks.
#[derive(Debug, Default)]
pub struct Cutter {
    bends: Vec<f64>,
    steps: Vec<f64>,
    sums: Vec<f64>,
    moments: Vec<f64>,
    quick_look: QuickLook,
    /// Whether a point may be a cut.
    suspects: Vec<u8>,
}

impl Cutter {
    /// The pieces of a frame, ordered by segment, then along the line. Most segments are smooth and need no closer look.
    #[inline(always)]
    pub fn cut(&mut self, lines: &Lines, correlation_px: f64, pieces: &mut Vec<Piece>) {
        pieces.clear();
        // A mean over n correlated points is as good as one over n / correlation length.
        let correlation = correlation_px.max(1.0).sqrt();
        for segment in 0..lines.starts.len() - 1 {
            let points = lines.starts[segment]..lines.starts[segment + 1];
            if points.len() < MIN_PIECE_POINTS {
                continue;
            }
            let (across, sigma_px) = (&lines.across()[points.clone()], &lines.sigma_px[points.clone()]);
            let along = &lines.along()[points];
            let mut add = |first: usize, end: usize| {
                if first + MIN_PIECE_POINTS <= end {
                    let stride = pieces::stride_for(end - first);
                    pieces.push(Piece {
                        frame: 0,
                        segment,
                        first,
                        end,
                        along: along[first].round() as i64,
                        stride,
                        continues: false,
                    });
                }
            };
            if self.quick_look.is_smooth(across, sigma_px, correlation) {
                add(0, across.len());
                continue;
            }
            self.measure(across, sigma_px, correlation);
            let (mut first, mut from) = (0, 0);
            while let Some(idx) = next_marked(&self.suspects, from) {
                from = idx + 1;
                if self.is_cut(across, sigma_px[idx], idx) {
                    add(first, idx.saturating_sub(CUT_TRIM_POINTS));
                    first = idx + CUT_TRIM_POINTS;
                }
            }
            add(first, across.len());
        }
    }

    /// Bends, steps and suspects of one segment.
    #[inline(always)]
    fn measure(&mut self, across: &[f64], sigma_px: &[f64], correlation: f64) {
        bends(across, &mut self.bends);
        self.running_sums(across);
        self.steps.clear();
        self.steps.resize(across.len(), 0.0);
        for (span, sigmas, least_px) in STEP_LIMITS {
            if across.len() >= 2 * span {
                self.steps_over(span, sigmas, least_px, sigma_px, correlation);
            }
        }
        self.mark_suspects(across);
    }

    #[inline(always)]
    fn running_sums(&mut self, across: &[f64]) {
        self.sums.resize(across.len() + 1, 0.0);
        self.moments.resize(across.len() + 1, 0.0);
        (self.sums[0], self.moments[0]) = (0.0, 0.0);
        let (mut sum, mut moment) = (0.0, 0.0);
        let (sums, moments) = (&mut self.sums[1..], &mut self.moments[1..]);
        let (sums, moments) = (&mut sums[..across.len()], &mut moments[..across.len()]);
        for place in 0..across.len() {
            let y = across[place] - across[0];
            sum += y;
            moment += place as f64 * y;
            sums[place] = sum;
            moments[place] = moment;
        }
    }

    /// Misses of the lines through `span` points on either side, in limits; the larger of all spans stays.
    #[inline(always)]
    fn steps_over(&mut self, span: usize, sigmas: f64, least_px: f64, sigma_px: &[f64], correlation: f64) {
        let n = sigma_px.len() + 1 - 2 * span;
        let (first, middle, last) = (&self.sums[..n], &self.sums[span..][..n], &self.sums[2 * span..][..n]);
        let (m_first, m_middle) = (&self.moments[..n], &self.moments[span..][..n]);
        let m_last = &self.moments[2 * span..][..n];
        let (steps, sigma_px) = (&mut self.steps[span..][..n], &sigma_px[span..][..n]);
        let (constant, slope) = pieces::end_weights(span);
        let reach = (2 * span - 1) as f64;
        for i in 0..n {
            let place = f64::from(i as u32);
            // The line through the points before, half a point beyond the last: Σ (α + β j) y over j = 0 … span − 1.
            let (before, moment) = (middle[i] - first[i], m_middle[i] - m_first[i]);
            let ends = constant * before + slope * (moment - place * before);
            // The line through the points after, half a point before the first, counted backwards.
            let (after, moment) = (last[i] - middle[i], m_last[i] - m_middle[i]);
            let starts = constant * after + slope * ((place + reach) * after - moment);
            let limit = sigmas * (sigma_px[i] * correlation);
            let step = (ends - starts).abs() / if limit > least_px { limit } else { least_px };
            steps[i] = if step > steps[i] { step } else { steps[i] };
        }
    }

    /// Marks jumps, and bends and steps above their limits before noise and neighbours are asked.
    #[inline(always)]
    fn mark_suspects(&mut self, across: &[f64]) {
        let n = across.len();
        self.suspects.resize(n, 0);
        self.suspects[0] = 0;
        let (here, before) = (&across[1..n], &across[..n - 1]);
        let (bends, steps, suspects) = (&self.bends[1..n], &self.steps[1..n], &mut self.suspects[1..n]);
        for i in 0..n - 1 {
            let jump = (here[i] - before[i]).abs() > KINK_STEP_PX;
            suspects[i] = u8::from(jump | (bends[i] > KINK_SLOPE) | (steps[i] > 1.0));
        }
    }

    #[inline(always)]
    fn is_cut(&self, across: &[f64], sigma_px: f64, idx: usize) -> bool {
        // A bend is a second difference: √6 times the noise of one point.
        let bend_sigma = 6f64.sqrt() * sigma_px / KINK_SPAN_PX as f64;
        (across[idx] - across[idx - 1]).abs() > KINK_STEP_PX
            || self.bends[idx] > KINK_SLOPE.max(KINK_SIGMAS * bend_sigma) && pieces::is_peak(&self.bends, idx)
            || self.steps[idx] > 1.0 && pieces::is_peak(&self.steps, idx)
    }
}

/// Per point: the change of slope from the points before it to those after it, px/px.
#[inline(always)]
fn bends(across: &[f64], bends: &mut Vec<f64>) {
    bends.resize(across.len(), 0.0);
    let Some(n) = across.len().checked_sub(2 * KINK_SPAN_PX) else { return bends.fill(0.0) };
    bends[..KINK_SPAN_PX].fill(0.0);
    bends[KINK_SPAN_PX + n..].fill(0.0);
    let (behind, here) = (&across[..n], &across[KINK_SPAN_PX..][..n]);
    let (ahead, bends) = (&across[2 * KINK_SPAN_PX..][..n], &mut bends[KINK_SPAN_PX..][..n]);
    for i in 0..n {
        bends[i] = ((ahead[i] - here[i]) - (here[i] - behind[i])).abs() / KINK_SPAN_PX as f64;
    }
}

/// Index of the first marked byte from `from` on.
#[inline(always)]
fn next_marked(marks: &[u8], from: usize) -> Option<usize> {
    let mut idx = from;
    while idx + TOGETHER <= marks.len() {
        let word = marks[idx..].first_chunk::<TOGETHER>().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        if word != 0 {
            return Some(idx + (word.trailing_zeros() / u8::BITS) as usize);
        }
        idx += TOGETHER;
    }
    (idx..marks.len()).find(|&idx| marks[idx] != 0)
}

#[cfg(test)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    #[test]
    fn whatever_is_suspect_shows_at_a_quick_look() {
        let mut rng = Pcg64Mcg::seed_from_u64(13);
        let (mut n_smooth, mut n_suspect) = (0, 0);
        for n_points in (1..400).chain(1..400) {
            let (slope, bend, step) = (
                rng.random_range(-1.5..1.5),
                rng.random_range(-0.35..0.35),
                rng.random_range(-0.4..0.4) * f64::from(rng.random_range(0..2)),
            );
            let place = rng.random_range(0..n_points);
            let across: Vec<f64> = (0..n_points)
                .map(|idx| {
                    let beyond = if idx >= place { step + bend * f64::from(idx - place) } else { 0.0 };
                    700.0 + slope * f64::from(idx) + beyond + rng.random_range(-0.05..0.05)
                })
                .collect();
            let sigma_px: Vec<f64> = (0..n_points).map(|_| rng.random_range(0.01..0.1)).collect();
            let mut cutter = Cutter::default();
            cutter.measure(&across, &sigma_px, 1.2);
            let is_smooth = cutter.quick_look.is_smooth(&across, &sigma_px, 1.2);
            let is_suspect = cutter.suspects.contains(&1);
            assert!(!(is_smooth && is_suspect), "{n_points} points");
            n_smooth += usize::from(is_smooth);
            n_suspect += usize::from(is_suspect);
        }
        assert!(n_suspect > 200 && n_smooth + n_suspect > 750, "{n_suspect} suspect, {n_smooth} smooth of 798");
    }
}
