//! Averaging along the line, several columns at a time, by local parabolas in the longest window that fits the line.
//!
//! Noise falls with the length of the window, and a parabola preserves curvature. Where a longer window contradicts a
//! shorter one by more than their noise, in a column or on average of its surroundings, the shorter one is used (after
//! Lepski 1991: the largest bandwidth that is consistent with all smaller ones). All crossings of a window have equal
//! weight: the noise estimated from a single column is mostly speckle, and weights derived from it reduce accuracy. Fits
//! are therefore convolutions with fixed kernels.

use super::departures::Departure;
use super::kernels::{MAX_LAG, RUN};
use super::means::{AllWindows, MAX_WINDOWS, Mean, slopes};
use super::points::{Chosen, NONE};
use super::windows::{Along, Block, Windows};
use crate::centreline::CentrelinePoint;
use crate::centreline::fast::across::pieces::{Crossings, Piece};
use crate::centreline::fast::lanes::{LANES, Numbers};
use crate::centreline::lines::scatter::Scatter;
use crate::params::{
    ALONG_AGREEMENT_SIGMAS, ALONG_HALF_LENGTH_WIDTHS, ALONG_MAX_HALF_LENGTH, ALONG_MIN_DIFFERENCE,
    ALONG_MIN_HALF_LENGTH,
};

/// Fits local parabolas along lines; its memory is reused from image to image.
#[derive(Default)]
pub struct Averager {
    /// Windows by length, the shortest first.
    windows: Vec<Windows>,
    /// All windows together.
    all: AllWindows,
    /// Windows prepared for earlier widths, kept because widths recur.
    others: Vec<Windows>,
    longest: usize,
    /// Differences of each window but the first from the one before, averaged over columns.
    departures: Vec<Departure>,
    /// Columns before and after a block that windows and departures need.
    reach: usize,
    /// Variance of every crossing of a piece, zero beyond its ends.
    variances: Vec<f32>,
    /// Rows of a block and its surroundings, relative to the block's first row.
    rows: Vec<f32>,
}

/// Columns whose rows are loaded at a time. Data just written piecewise is slow to read as a whole, so this is done per
/// group, not per block.
const GROUP: usize = 4 * LANES;

/// Half-lengths of all windows, the longest first.
pub fn half_lengths(longest: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(longest), |&half| (half >= 2 * ALONG_MIN_HALF_LENGTH).then_some(half / 2))
}

impl Averager {
    /// Prepares for the lines of an image of a typical width (full, at half height).
    pub fn prepare(&mut self, width_px: f32, scatter: &Scatter) {
        let longest = (ALONG_HALF_LENGTH_WIDTHS * width_px).round() as usize;
        self.longest = longest.clamp(2 * ALONG_MIN_HALF_LENGTH, ALONG_MAX_HALF_LENGTH);
        let correlations: [f64; MAX_LAG + 1] = std::array::from_fn(|lag| scatter.correlation(lag));
        self.others.append(&mut self.windows);
        for half_length in half_lengths(self.longest) {
            let known = self.others.iter().position(|windows| windows.kernels().half_length() == half_length);
            let mut windows = known.map_or_else(Windows::default, |idx| self.others.swap_remove(idx));
            windows.prepare(half_length, &correlations);
            self.windows.push(windows);
        }
        self.windows.reverse();
        self.all.prepare(self.windows.iter().map(Windows::kernels));
        self.departures.resize_with(self.windows.len() - 1, Departure::default);
        for (departure, pair) in self.departures.iter_mut().zip(self.windows.windows(2)) {
            departure.prepare(pair[0].kernels(), pair[1].kernels(), &correlations);
        }
        self.reach = self.departures.iter().map(Departure::reach).fold(self.longest, usize::max);
    }

    /// Replaces `points` by the averaged points of a piece, and appends the reduction of their variance to `gains`.
    #[inline(always)]
    pub fn average(
        &mut self,
        crossings: &Crossings,
        piece: &Piece,
        scatter: &Scatter,
        points: &mut Vec<CentrelinePoint>,
        gains: &mut Vec<f32>,
    ) {
        let n = piece.places.len();
        self.predict(crossings, piece, scatter);
        let rows = &crossings.v[piece.places.clone()];
        points.resize(n, CentrelinePoint::UNWRITTEN);
        for start in (0..n).step_by(LANES) {
            let block = Block { start, n };
            if start.is_multiple_of(GROUP) {
                self.load_rows(rows, start);
            }
            let at = self.reach + start % GROUP;
            let chosen = if block.is_whole(self.longest) {
                self.chosen::<true>(block, at)
            } else {
                self.chosen::<false>(block, at)
            };
            let places = piece.places.start + start..(piece.places.start + start + LANES).min(piece.places.end);
            let description = chosen.described();
            // One block of every group is sampled, and one of a short piece.
            if start % GROUP == GROUP / 2 || n <= GROUP / 2 && start == 0 {
                gains.push(self.variances[self.longest + start] / chosen.mean.variance.0[0]);
            }
            let (first_u, row) = (piece.first_u + start, rows[start - start % GROUP]);
            description.write(crossings, places.clone(), first_u, row, &mut points[start..start + places.len()]);
        }
    }

    /// Variances of the crossings of a piece.
    #[inline(always)]
    fn predict(&mut self, crossings: &Crossings, piece: &Piece, scatter: &Scatter) {
        let speckle = scatter.speckle() as f32;
        let cameras = &crossings.camera_variance[piece.places.clone()];
        let speckles = &crossings.speckle_variance[piece.places.clone()];
        self.variances.clear();
        self.variances.resize(piece.places.len() + 2 * self.longest + LANES, 0.0);
        let variances = &mut self.variances[self.longest..];
        for ((variance, camera), of_speckle) in variances.iter_mut().zip(cameras).zip(speckles) {
            *variance = (camera + speckle * of_speckle).max(1e-8);
        }
    }

    /// Loads the rows of the group of blocks at `start` and its surroundings, relative to its first row.
    #[inline(always)]
    fn load_rows(&mut self, rows: &[f64], start: usize) {
        let pad = self.reach;
        let (from, to) = (start.saturating_sub(pad), (start + GROUP + pad).min(rows.len()));
        let base = rows[start];
        self.rows.resize(GROUP + 2 * pad + RUN, 0.0);
        let near = &mut self.rows[from + pad - start..][..to - from];
        near.iter_mut().zip(&rows[from..to]).for_each(|(near, &row)| *near = (row - base) as f32);
    }

    /// The longest window of every lane that agrees with all shorter ones, and its fit. The block begins at index `at`
    /// of the rows; `WHOLE` if no window is cut by the ends of the piece.
    #[inline(always)]
    fn chosen<const WHOLE: bool>(&mut self, block: Block, at: usize) -> Chosen {
        let agreement = (ALONG_AGREEMENT_SIGMAS * ALONG_AGREEMENT_SIGMAS) as f32;
        let (zero, one) = (Numbers::default(), Numbers::splat(1.0));
        // Without any fit a crossing keeps its measured position.
        let mut window = Numbers::splat(NONE);
        let mut mean = Mean {
            value: Numbers::of(&self.rows[at..]),
            variance: Numbers::of(&self.variances[self.longest + block.start..]),
        };
        let whole = self.all.fit(&self.rows[at - self.longest..], &self.variances[block.start..]);
        let first = MAX_WINDOWS - self.windows.len();
        // 1 until a window contradicts a shorter one.
        let mut open = one;
        for idx in 0..self.windows.len() {
            let mut next = whole.means[first + idx];
            // 1 where the window holds enough crossings, otherwise 0.
            let mut valid = one;
            if !WHOLE {
                let rows = Along { numbers: &self.rows, at };
                let variances = Along { numbers: &self.variances, at: self.longest + block.start };
                valid = self.windows[idx].cut_means(block, rows, variances, &mut next);
            }
            let noise = (mean.variance - next.variance).max(mean.variance * ALONG_MIN_DIFFERENCE as f32);
            let departure = next.value - mean.value;
            let allowed = window.where_over(Numbers::splat(NONE), noise * agreement, Numbers::splat(f32::MAX));
            let mut contradicts = (departure * departure).where_over(allowed, valid, zero);
            if let Some(averaged) = idx.checked_sub(1).map(|before| &self.departures[before])
                && block.is_whole(averaged.reach())
            {
                let departure = averaged.of(&self.rows, at);
                let allowed = next.variance * (agreement * averaged.gain());
                contradicts = (departure * departure).where_over(allowed, valid, contradicts);
            }
            open = contradicts.where_over(zero, zero, open);
            let better = open * valid;
            window = better.where_over(zero, Numbers::splat(idx as f32), window);
            mean.value = better.where_over(zero, next.value, mean.value);
            mean.variance = better.where_over(zero, next.variance, mean.variance);
        }
        let mut slopes = self.whole_slopes(window, whole.slope, at);
        if !WHOLE {
            let rows = Along { numbers: &self.rows, at };
            for (idx, windows) in self.windows.iter_mut().enumerate() {
                windows.cut_slopes(block, rows, &window.is(idx as f32), &mut slopes);
            }
        }
        Chosen { mean, slopes }
    }

    /// The slope of every lane in the whole window chosen for it; `longest` are the slopes in the longest window.
    #[inline(always)]
    fn whole_slopes(&self, window: Numbers, longest: Numbers, at: usize) -> Numbers {
        let mut chosen_slopes = longest;
        // Usually all lanes choose the longest window.
        for idx in 0..self.windows.len() - 1 {
            let chosen = window.is(idx as f32);
            if chosen.any_over_zero() {
                let kernels = self.windows[idx].kernels();
                let of_this = slopes(kernels, &self.rows[at - kernels.half_length()..]);
                chosen_slopes = chosen.where_over(Numbers::default(), of_this, chosen_slopes);
            }
        }
        chosen_slopes
    }
}
