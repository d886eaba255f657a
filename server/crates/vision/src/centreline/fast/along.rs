//! Averaging along the line as the reference does it, eight columns at a time: a weighted local parabola, as long as
//! the line agrees with one.
//!
//! Moments of the weights are sums over shifted arrays; the noise shared between columns enters as a factor on the
//! variance, exact for even weights.

use super::lanes::{LANES, Numbers};
use super::pieces::{Crossings, Piece};
use crate::centreline::CentrelinePoint;
use crate::centreline::reference::scatter::Scatter;
use crate::params::{
    ALONG_AGREEMENT_SIGMAS, ALONG_HALF_LENGTH_WIDTHS, ALONG_MAX_HALF_LENGTH, ALONG_MIN_HALF_LENGTH, SKEW_DOUBT,
};

/// Farthest lag, in columns, at which noise is still taken as shared.
const MAX_LAG: usize = 8;
/// A window whose determinant is a smaller part of its diagonal's product holds too few points. A parabola fitted to
/// one side of its vertex has some 0.003.
const MIN_DETERMINANT: f32 = 1e-4;

type Lanes = [f32; LANES];

/// Fits local parabolas along lines; keeps its memory from image to image.
#[derive(Default)]
pub struct Averager {
    windows: Vec<Window>,
    longest: usize,
    correlation_px: f32,
    weights: Vec<f32>,
    detrended: Vec<f32>,
}

/// One length of window; x runs from −1 to 1 between the first points of weight zero.
#[derive(Default)]
struct Window {
    half_length: usize,
    /// Taper times 1, x, x², x³, x⁴, for every place from the middle on.
    moments: Vec<[f32; 5]>,
    /// Factor on the variance for shared noise, by how many places on either side the line has; not a number before it
    /// is asked for.
    shared: Vec<f32>,
    correlations: [f64; MAX_LAG + 1],
}

/// Parabolas fitted to eight windows: value, slope and bend (of x scaled) at the middle, and the first and last
/// entries of the inverse of the normal matrix's diagonal.
struct Fits {
    valid: [bool; LANES],
    value: Lanes,
    slope: Lanes,
    bend: Lanes,
    value_variance: Lanes,
    bend_variance: Lanes,
}

impl Averager {
    /// Prepares for the lines of an image of a typical width (full, at half height).
    pub fn prepare(&mut self, width_px: f32, scatter: &Scatter) {
        let longest = (ALONG_HALF_LENGTH_WIDTHS * width_px).round() as usize;
        self.longest = longest.clamp(2 * ALONG_MIN_HALF_LENGTH, ALONG_MAX_HALF_LENGTH);
        let halves =
            std::iter::successors(Some(self.longest), |&h| (h >= 2 * ALONG_MIN_HALF_LENGTH).then_some(h / 2));
        let correlations: [f64; MAX_LAG + 1] = std::array::from_fn(|lag| scatter.correlation(lag));
        let n_windows = halves.clone().count();
        self.windows.resize_with(n_windows, Window::default);
        for (window, half_length) in self.windows.iter_mut().rev().zip(halves) {
            window.prepare(half_length, &correlations);
        }
        self.correlation_px = scatter.correlation_px() as f32;
    }

    /// Adds the averaged points of a piece to `points`, and for every eighth how much less it varies to `gains`.
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
        let unit = self.weigh(crossings, piece, scatter);
        let per_unit = 1.0 / unit;
        let rows = &crossings.v[piece.places.clone()];
        points.reserve(n);
        for start in (0..n).step_by(LANES) {
            let (base, trend) = self.detrend(rows, start);
            let chosen = self.chosen(start, n, per_unit);
            let mut cross_variance_px2 = [0.0f32; LANES];
            let places = piece.places.start + start..(piece.places.start + start + LANES).min(piece.places.end);
            cross_variance_px2
                .iter_mut()
                .zip(&crossings.cross_variance_px2[places.clone()])
                .for_each(|(c, &v)| *c = v);
            let own_variance: Lanes =
                std::array::from_fn(|i| per_unit / self.weights[self.longest + start + i].max(f32::MIN_POSITIVE));
            let fits = chosen.described(trend, &cross_variance_px2, &own_variance, per_unit, self.correlation_px);
            gains.push(own_variance[0] / fits.variance[0]);
            for (i, place) in places.enumerate() {
                points.push(CentrelinePoint {
                    u_px: (piece.first_u + start + i) as f64,
                    v_px: base + (f64::from(trend) * i as f64 + f64::from(fits.shift[i])),
                    normal: [f64::from(fits.normal_u[i]), f64::from(fits.across[i])],
                    sigma_px: f64::from(fits.sigma_px[i]),
                    intensity: crossings.intensity[place],
                    width_px: crossings.width_px[place] * fits.across[i],
                    saturated: crossings.saturated[place],
                });
            }
        }
    }

    /// Inverse variances of a piece, nothing beyond its ends, in units of the largest, which is returned.
    #[inline(always)]
    fn weigh(&mut self, crossings: &Crossings, piece: &Piece, scatter: &Scatter) -> f32 {
        let (n, pad) = (piece.places.len(), self.longest);
        let speckle = scatter.speckle() as f32;
        let cameras = &crossings.camera_variance[piece.places.clone()];
        let speckles = &crossings.speckle_variance[piece.places.clone()];
        self.weights.clear();
        self.weights.resize(n + 2 * pad + LANES, 0.0);
        let weights = &mut self.weights[pad..pad + n];
        for ((weight, camera), of_speckle) in weights.iter_mut().zip(cameras).zip(speckles) {
            *weight = 1.0 / (camera + speckle * of_speckle).max(1e-8);
        }
        let unit = weights.iter().fold(0.0f32, |a, &b| if b > a { b } else { a });
        let per_unit = 1.0 / unit;
        weights.iter_mut().for_each(|weight| *weight *= per_unit);
        unit
    }

    /// Rows of the block at `start` and of its surroundings with a straight line taken off: its row at `start` and its
    /// slope.
    #[inline(always)]
    fn detrend(&mut self, rows: &[f64], start: usize) -> (f64, f32) {
        let pad = self.longest;
        let (from, to) = (start.saturating_sub(pad), (start + LANES + pad).min(rows.len()) - 1);
        let trend = ((rows[to] - rows[from]) / (to - from).max(1) as f64) as f32;
        let base = rows[start];
        self.detrended.clear();
        self.detrended.resize(LANES + 2 * pad, 0.0);
        let first_x = from as f32 - start as f32;
        let detrended = &mut self.detrended[from + pad - start..][..to + 1 - from];
        for (j, (out, &row)) in detrended.iter_mut().zip(&rows[from..=to]).enumerate() {
            *out = (row - base) as f32 - trend * (first_x + j as u32 as f32);
        }
        (base, trend)
    }

    /// For every lane the longest window that agrees with all shorter ones, and its fit.
    #[inline(always)]
    fn chosen(&mut self, start: usize, n: usize, per_unit: f32) -> Chosen {
        let agreement = (ALONG_AGREEMENT_SIGMAS * ALONG_AGREEMENT_SIGMAS) as f32 * per_unit;
        let mut chosen = Chosen::default();
        // Without any fit a crossing stands where it was measured.
        chosen.value.copy_from_slice(&self.detrended[self.longest..][..LANES]);
        let mut closed = [false; LANES];
        for window in &mut self.windows {
            let shared = window.shared(start, n);
            let fits = window.fit(
                &self.weights[start + self.longest - window.half_length..],
                &self.detrended[self.longest - window.half_length..],
            );
            let per_px = window.per_px();
            let squared = per_px * per_px;
            for i in 0..LANES {
                let variance = fits.value_variance[i] * shared[i];
                let shorter = chosen.variance[i];
                let noise = (shorter - variance).max(0.1 * shorter);
                let departure = fits.value[i] - chosen.value[i];
                let contradicts = chosen.any[i] & (departure * departure > agreement * noise);
                closed[i] |= fits.valid[i] & contradicts;
                let better = fits.valid[i] & !closed[i];
                let choose = |new: f32, old: f32| if better { new } else { old };
                chosen.any[i] |= better;
                chosen.value[i] = choose(fits.value[i], chosen.value[i]);
                chosen.slope[i] = choose(fits.slope[i] * per_px, chosen.slope[i]);
                chosen.bend[i] = choose(fits.bend[i] * squared, chosen.bend[i]);
                chosen.variance[i] = choose(variance, chosen.variance[i]);
                let bend_variance = fits.bend_variance[i] * (squared * squared);
                chosen.bend_variance[i] = choose(bend_variance, chosen.bend_variance[i]);
            }
        }
        chosen
    }
}

/// The fit chosen in every lane; x in columns.
#[derive(Default)]
struct Chosen {
    any: [bool; LANES],
    value: Lanes,
    slope: Lanes,
    bend: Lanes,
    variance: Lanes,
    bend_variance: Lanes,
}

/// What is told of eight points.
struct Described {
    /// Rows above the trend.
    shift: Lanes,
    variance: Lanes,
    normal_u: Lanes,
    across: Lanes,
    sigma_px: Lanes,
}

impl Chosen {
    /// Position, normal and σ; a crossing without a fit stands for itself.
    #[inline(always)]
    fn described(
        &self,
        trend: f32,
        cross_variance_px2: &Lanes,
        own_variance: &Lanes,
        per_unit: f32,
        correlation_px: f32,
    ) -> Described {
        let [mut shift, mut variance, mut normal_u, mut across, mut sigma_px] = [[0.0f32; LANES]; 5];
        for i in 0..LANES {
            let any = self.any[i];
            let slope = if any { trend + self.slope[i] } else { 0.0 };
            let bend = self.bend[i];
            let bend_variance = self.bend_variance[i] * per_unit * correlation_px;
            let sure = (1.0 - SKEW_DOUBT * bend_variance / (bend * bend).max(f32::MIN_POSITIVE)).max(0.0);
            let skew = sure * skew_shift(slope, 2.0 * bend, cross_variance_px2[i]);
            shift[i] = self.value[i] - skew;
            variance[i] = if any { (self.variance[i] * per_unit).max(1e-10) } else { own_variance[i] };
            across[i] = 1.0 / (1.0 + slope * slope).sqrt();
            normal_u[i] = -slope * across[i];
            sigma_px[i] = variance[i].sqrt() * across[i];
        }
        Described { shift, variance, normal_u, across, sigma_px }
    }
}

impl Window {
    fn prepare(&mut self, half_length: usize, correlations: &[f64; MAX_LAG + 1]) {
        let reach = (half_length + 1) as f64;
        let x_of = |k: usize| k as f64 / reach;
        self.half_length = half_length;
        self.moments.clear();
        let moment = |x: f64, power: i32| ((1.0 - x * x) * x.powi(power)) as f32;
        self.moments.extend((0..=half_length).map(|k| std::array::from_fn(|power| moment(x_of(k), power as i32))));
        self.shared.clear();
        self.shared.resize((half_length + 1) * (half_length + 1), f32::NAN);
        self.correlations = *correlations;
    }

    fn per_px(&self) -> f32 {
        1.0 / (self.half_length + 1) as f32
    }

    /// Factors on the variance for eight columns of `n` from `start` on.
    #[inline(always)]
    fn shared(&mut self, start: usize, n: usize) -> Lanes {
        let half = self.half_length;
        if start >= half && start + LANES + half <= n {
            return [self.shared_at(half, half); LANES];
        }
        std::array::from_fn(|i| {
            let idx = (start + i).min(n - 1);
            self.shared_at(idx.min(half), (n - 1 - idx).min(half))
        })
    }

    fn shared_at(&mut self, before: usize, after: usize) -> f32 {
        let place = before * (self.half_length + 1) + after;
        if self.shared[place].is_nan() {
            let reach = (self.half_length + 1) as f64;
            self.shared[place] = shared_noise(before, after, reach, &self.correlations) as f32;
        }
        self.shared[place]
    }

    /// Fits eight parabolas; `weights` and `rows` begin at the first place of the first window.
    ///
    /// Even moments take the sum of the places on either side of the middle, odd ones their difference.
    #[inline(always)]
    fn fit(&self, weights: &[f32], rows: &[f32]) -> Fits {
        let half = self.half_length;
        let (weights, rows) = (&weights[..2 * half + LANES], &rows[..2 * half + LANES]);
        let w = Numbers::of(&weights[half..]);
        let zero = Numbers::default();
        let (mut s0, mut s1, mut s2, mut s3, mut s4) = (w, zero, zero, zero, zero);
        let (mut t0, mut t1, mut t2) = (w * Numbers::of(&rows[half..]), zero, zero);
        for (k, &[m0, m1, m2, m3, m4]) in self.moments.iter().enumerate().skip(1) {
            let (before, after) = (Numbers::of(&weights[half - k..]), Numbers::of(&weights[half + k..]));
            let (sum, difference) = (after + before, after - before);
            let (before, after) =
                (before * Numbers::of(&rows[half - k..]), after * Numbers::of(&rows[half + k..]));
            let (sum_y, difference_y) = (after + before, after - before);
            s0 = s0 + sum * m0;
            s1 = s1 + difference * m1;
            s2 = s2 + sum * m2;
            s3 = s3 + difference * m3;
            s4 = s4 + sum * m4;
            t0 = t0 + sum_y * m0;
            t1 = t1 + difference_y * m1;
            t2 = t2 + sum_y * m2;
        }
        solved(&[s0, s1, s2, s3, s4].map(|s| s.0), &[t0, t1, t2].map(|t| t.0))
    }
}

#[inline(always)]
fn solved(s: &[Lanes; 5], t: &[Lanes; 3]) -> Fits {
    let mut fits = Fits {
        valid: [false; LANES],
        value: [0.0; LANES],
        slope: [0.0; LANES],
        bend: [0.0; LANES],
        value_variance: [0.0; LANES],
        bend_variance: [0.0; LANES],
    };
    for i in 0..LANES {
        let [s0, s1, s2, s3, s4] = [s[0][i], s[1][i], s[2][i], s[3][i], s[4][i]];
        let (c00, c01, c02) = (s2 * s4 - s3 * s3, s2 * s3 - s1 * s4, s1 * s3 - s2 * s2);
        let (c11, c12, c22) = (s0 * s4 - s2 * s2, s1 * s2 - s0 * s3, s0 * s2 - s1 * s1);
        let determinant = s0 * c00 + s1 * c01 + s2 * c02;
        let valid = determinant > MIN_DETERMINANT * s0 * s2 * s4;
        let inverse = 1.0 / if valid { determinant } else { 1.0 };
        fits.valid[i] = valid;
        fits.value[i] = (c00 * t[0][i] + c01 * t[1][i] + c02 * t[2][i]) * inverse;
        fits.slope[i] = (c01 * t[0][i] + c11 * t[1][i] + c12 * t[2][i]) * inverse;
        fits.bend[i] = (c02 * t[0][i] + c12 * t[1][i] + c22 * t[2][i]) * inverse;
        fits.value_variance[i] = c00 * inverse;
        fits.bend_variance[i] = c22 * inverse;
    }
    fits
}

/// Variance of the value at x = 0 of a tapered parabola through evenly noisy places with shared noise, `before` and
/// `after` it, over what the inverse of the normal matrix says.
fn shared_noise(before: usize, after: usize, reach: f64, correlations: &[f64; MAX_LAG + 1]) -> f64 {
    let n = before + after + 1;
    let x_of = |k: usize| (k as f64 - before as f64) / reach;
    let mut s = [0.0f64; 5];
    for x in (0..n).map(x_of) {
        (0..5).for_each(|power| s[power] += (1.0 - x * x) * x.powi(power as i32));
    }
    let first = [s[2] * s[4] - s[3] * s[3], s[2] * s[3] - s[1] * s[4], s[1] * s[3] - s[2] * s[2]];
    let determinant = s[0] * first[0] + s[1] * first[1] + s[2] * first[2];
    if determinant <= f64::from(MIN_DETERMINANT) * s[0] * s[2] * s[4] {
        return 1.0;
    }
    let mut kernel = [0.0f64; 2 * ALONG_MAX_HALF_LENGTH + 1];
    let kernel = &mut kernel[..n];
    for (k, weight) in kernel.iter_mut().enumerate() {
        let x = x_of(k);
        *weight = (1.0 - x * x) * (first[0] + x * (first[1] + x * first[2])) / determinant;
    }
    let products = |lag: usize| kernel.iter().zip(kernel.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
    let sum = products(0) + (1..=MAX_LAG).map(|lag| 2.0 * correlations[lag] * products(lag)).sum::<f64>();
    sum * determinant / first[0]
}

/// How far (rows) the centre of a column's profile lies from a line that is steep and curved at once: to first order
/// in the curvature v″ it is 3/2 · v″ · m² / (1 + m²)² · s², m the slope and s² the variance of profile times window.
#[inline(always)]
fn skew_shift(slope: f32, curvature: f32, cross_variance_px2: f32) -> f32 {
    let steep = slope * slope;
    1.5 * curvature * steep / ((1.0 + steep) * (1.0 + steep)) * cross_variance_px2
}
