//! The bias that averaging leaves on a line of known course.

use super::along::half_lengths;
use super::departures::Departure;
use super::kernels::{Kernel, Kernels, MAX_LAG};
use crate::centreline::fast::lanes::LANES;
use crate::params::{ALONG_AGREEMENT_SIGMAS, ALONG_MAX_HALF_LENGTH, ALONG_MIN_DIFFERENCE, ALONG_MIN_HALF_LENGTH};

/// Correlation length of points that are averages of a window, per column of its half-length plus one: the inverse of the
/// sum of its squared weights, within 2 % for 6 columns and more.
const CORRELATION_PER_COLUMN: f64 = 0.79;

/// The windows of an extraction, and the bias they leave where a line of known course is no parabola.
///
/// The window taken to be used is the longest whose expected differences from the shorter ones stay below the limits at
/// which the extraction shortens it (`docs/maths/centreline.md`, Curved lines).
pub struct AveragingBias {
    /// The shortest first.
    windows: Vec<Kernels>,
    /// Difference of each window but the first from the one before, averaged over columns.
    departures: Vec<Departure>,
}

/// A window about a point.
struct Candidate {
    /// Index of the window.
    idx: usize,
    bias_px: f64,
    /// Variance of the mean over that of a crossing.
    gain: f64,
}

impl AveragingBias {
    /// For points that share their noise over `correlation_px` columns, which shows how long the windows were
    /// ([`crate::Centrelines::correlation_px`]): none if that is less than the shortest.
    pub fn new(correlation_px: f64) -> Self {
        let half_length = (correlation_px / CORRELATION_PER_COLUMN - 1.0).round() as usize;
        let longest = half_length.min(ALONG_MAX_HALF_LENGTH);
        let independent = [0.0; MAX_LAG + 1];
        let window = |half_length| {
            let mut kernels = Kernels::default();
            kernels.prepare(half_length, &independent);
            kernels.prepare_cut();
            kernels
        };
        let halves = half_lengths(longest).filter(|&half| half >= ALONG_MIN_HALF_LENGTH);
        let mut windows: Vec<Kernels> = halves.map(window).collect();
        windows.reverse();
        let departure = |pair: &[Kernels]| {
            let mut departure = Departure::default();
            departure.prepare(&pair[0], &pair[1], &independent);
            departure
        };
        let departures = windows.windows(2).map(departure).collect();
        Self { windows, departures }
    }

    /// Columns on either side of a point that affect it.
    pub fn reach(&self) -> usize {
        let longest = self.windows.last().map_or(0, Kernels::half_length);
        self.departures.iter().map(Departure::reach).fold(longest, usize::max)
    }

    /// Expected error of the row at index `at` of a line with these true rows, one per column, px; `sigma_px`: of its point.
    /// The line ends where the rows do. 0 where no window holds enough columns.
    pub fn at(&self, rows_px: &[f32], at: usize, sigma_px: f64) -> f64 {
        let candidates: Vec<Candidate> =
            (0..self.windows.len()).filter_map(|idx| self.candidate(idx, rows_px, at)).collect();
        let is_used = |n: &usize| {
            // Of a crossing, if the point is the mean of this window.
            let variance = sigma_px * sigma_px / candidates[n - 1].gain;
            let limit = ALONG_AGREEMENT_SIGMAS * ALONG_AGREEMENT_SIGMAS * variance;
            candidates[..*n].windows(2).all(|pair| {
                let noise = (pair[0].gain - pair[1].gain).max(ALONG_MIN_DIFFERENCE * pair[0].gain);
                (pair[1].bias_px - pair[0].bias_px).powi(2) <= limit * noise
                    && self.departs(pair[1].idx, rows_px, at).is_none_or(|(departure_px, gain)| {
                        departure_px * departure_px <= limit * gain * pair[1].gain
                    })
            })
        };
        let n_used = (1..=candidates.len()).rev().find(is_used);
        n_used.map_or(0.0, |n| candidates[n - 1].bias_px)
    }

    fn candidate(&self, idx: usize, rows_px: &[f32], at: usize) -> Option<Candidate> {
        let (kernel, before) = self.kernel(idx, rows_px.len(), at)?;
        let weights = kernel.value.iter().map(|&weight| f64::from(weight));
        let own = rows_px[at];
        let offsets = rows_px[at - before..].iter().map(|row| f64::from(row - own));
        Some(Candidate {
            idx,
            bias_px: weights.zip(offsets).map(|(weight, offset)| weight * offset).sum(),
            gain: kernel.squared.iter().map(|&square| f64::from(square)).sum(),
        })
    }

    /// The kernel of a window about a point, and how many columns before it that begins; `None` with too few points.
    fn kernel(&self, idx: usize, n: usize, at: usize) -> Option<(&Kernel, usize)> {
        let window = &self.windows[idx];
        let before = at.min(window.half_length());
        let kernel = window.prepared(before, (n - 1 - at).min(window.half_length()))?;
        Some((kernel, before))
    }

    /// The averaged difference of a window from the one before, and its variance over that of the window's mean; `None`
    /// near the ends of the line.
    fn departs(&self, idx: usize, rows_px: &[f32], at: usize) -> Option<(f64, f64)> {
        let departure = &self.departures[idx.checked_sub(1)?];
        let reach = departure.reach();
        let near = rows_px.get(at.checked_sub(reach)?..=at + reach)?;
        let own = rows_px[at];
        let offsets: Vec<f32> = near.iter().map(|row| row - own).chain(std::iter::repeat_n(0.0, LANES)).collect();
        Some((f64::from(departure.of(&offsets, reach).0[0]), f64::from(departure.gain())))
    }
}
