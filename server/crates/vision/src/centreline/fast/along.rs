//! Averaging along the line as the reference does it, eight columns at a time: a weighted local parabola, as long as
//! the line agrees with one.
//!
//! Moments of the weights are sums over shifted arrays; the noise shared between columns enters as a factor on the
//! variance, exact for even weights.

use crate::centreline::reference::along::Averaged;
use crate::centreline::reference::crossing::Crossing;
use crate::centreline::reference::scatter::Scatter;
use crate::params::{
    ALONG_AGREEMENT_SIGMAS, ALONG_HALF_LENGTH_WIDTHS, ALONG_MAX_HALF_LENGTH, ALONG_MIN_HALF_LENGTH, SKEW_DOUBT,
};

/// Columns averaged side by side.
const LANES: usize = 8;
/// Farthest lag, in columns, at which noise is still taken as shared.
const MAX_LAG: usize = 8;
/// A window whose determinant is a smaller part of its diagonal's product holds too few points. A parabola fitted to
/// one side of its vertex has some 0.003.
const MIN_DETERMINANT: f32 = 1e-4;

type Lanes = [f32; LANES];

/// Fits local parabolas along lines.
pub struct Averager {
    windows: Vec<Window>,
    longest: usize,
    correlation_px: f64,
    rows: Vec<f64>,
    weights: Vec<f32>,
    detrended: Vec<f32>,
}

/// One length of window; x runs from −1 to 1 between the first points of weight zero.
struct Window {
    half_length: usize,
    /// Taper times 1, x, x², x³, x⁴, for every place.
    moments: Vec<[f32; 5]>,
    /// Factor on the variance for shared noise, by how many places on either side the line has.
    shared: Vec<f32>,
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
    /// An averager for lines of a typical width (full, at half height).
    pub fn new(width_px: f32, scatter: &Scatter) -> Self {
        let longest = (ALONG_HALF_LENGTH_WIDTHS * width_px).round() as usize;
        let longest = longest.clamp(2 * ALONG_MIN_HALF_LENGTH, ALONG_MAX_HALF_LENGTH);
        let mut half_lengths = vec![longest];
        while half_lengths[half_lengths.len() - 1] >= 2 * ALONG_MIN_HALF_LENGTH {
            half_lengths.push(half_lengths[half_lengths.len() - 1] / 2);
        }
        let correlations: [f64; MAX_LAG + 1] = std::array::from_fn(|lag| scatter.correlation(lag));
        let windows = half_lengths.iter().rev().map(|&h| Window::new(h, &correlations)).collect();
        let correlation_px = scatter.correlation_px();
        Self { windows, longest, correlation_px, rows: vec![], weights: vec![], detrended: vec![] }
    }

    /// Calls `emit` with every crossing of `line` (neighbouring columns, no gaps), its own variance, and the averaged
    /// line there.
    #[inline(always)]
    pub fn average(
        &mut self,
        line: &[Crossing],
        scatter: &Scatter,
        mut emit: impl FnMut(&Crossing, f64, &Averaged),
    ) {
        let n = line.len();
        let pad = self.longest;
        self.rows.clear();
        self.rows.extend(line.iter().map(|c| c.v));
        self.weights.clear();
        self.weights.resize(pad, 0.0);
        self.weights.extend(line.iter().map(|c| (1.0 / scatter.variance(c).max(1e-8)) as f32));
        let unit = self.weights.iter().fold(0.0f32, |a, &b| a.max(b));
        let per_unit = 1.0 / unit;
        self.weights.iter_mut().for_each(|w| *w *= per_unit);
        self.weights.resize(n + 2 * pad + LANES, 0.0);
        for start in (0..n).step_by(LANES) {
            let (base, trend) = self.detrend(start, n);
            let n_lanes = LANES.min(n - start);
            let chosen = self.chosen(start, n, per_unit);
            for (i, crossing) in line[start..start + n_lanes].iter().enumerate() {
                let raw_variance = f64::from(per_unit / self.weights[pad + start + i]);
                let fit = self.averaged(&chosen, i, crossing, base + trend * i as f64, trend, f64::from(per_unit));
                let own = Averaged { v: crossing.v, slope: 0.0, variance: raw_variance };
                emit(crossing, raw_variance, &fit.unwrap_or(own));
            }
        }
    }

    /// Rows of the block at `start` and of its surroundings with a straight line taken off: its row at `start` and its
    /// slope.
    #[inline(always)]
    fn detrend(&mut self, start: usize, n: usize) -> (f64, f64) {
        let pad = self.longest;
        let (from, to) = (start.saturating_sub(pad), (start + LANES + pad).min(n) - 1);
        let trend = (self.rows[to] - self.rows[from]) / (to - from).max(1) as f64;
        let base = self.rows[start];
        self.detrended.clear();
        self.detrended.resize(LANES + 2 * pad, 0.0);
        for (j, &row) in self.rows[from..=to].iter().enumerate() {
            let x = (from + j) as f64 - start as f64;
            self.detrended[from + j + pad - start] = (row - base - trend * x) as f32;
        }
        (base, trend)
    }

    /// For every lane the longest window that agrees with all shorter ones, and its fit.
    #[inline(always)]
    fn chosen(&self, start: usize, n: usize, per_unit: f32) -> Chosen {
        let agreement = (ALONG_AGREEMENT_SIGMAS * ALONG_AGREEMENT_SIGMAS) as f32 * per_unit;
        let mut chosen = Chosen::default();
        let mut closed = [false; LANES];
        for window in &self.windows {
            let fits = window.fit(
                &self.weights[start + self.longest - window.half_length..],
                &self.detrended[self.longest - window.half_length..],
            );
            for i in 0..LANES {
                let shared = window.shared_at(start + i, n);
                let variance = fits.value_variance[i] * shared;
                let shorter = chosen.variance[i];
                let noise = (shorter - variance).max(0.1 * shorter);
                let departure = fits.value[i] - chosen.value[i];
                let contradicts = chosen.any[i] && departure * departure > agreement * noise;
                closed[i] |= fits.valid[i] && contradicts;
                if fits.valid[i] && !closed[i] {
                    let per_px = window.per_px();
                    chosen.any[i] = true;
                    chosen.value[i] = fits.value[i];
                    chosen.slope[i] = fits.slope[i] * per_px;
                    chosen.bend[i] = fits.bend[i] * per_px * per_px;
                    chosen.variance[i] = variance;
                    let squared = per_px * per_px;
                    chosen.bend_variance[i] = fits.bend_variance[i] * squared * squared;
                }
            }
        }
        chosen
    }

    #[inline(always)]
    fn averaged(
        &self,
        chosen: &Chosen,
        i: usize,
        crossing: &Crossing,
        trend_v: f64,
        trend: f64,
        per_unit: f64,
    ) -> Option<Averaged> {
        if !chosen.any[i] {
            return None;
        }
        let slope = trend + f64::from(chosen.slope[i]);
        let bend = f64::from(chosen.bend[i]);
        let bend_variance = f64::from(chosen.bend_variance[i]) * per_unit * self.correlation_px;
        let sure = (1.0 - SKEW_DOUBT * bend_variance / (bend * bend).max(f64::MIN_POSITIVE)).max(0.0);
        let skew = sure * skew_shift(slope, 2.0 * bend, crossing.cross_variance_px2);
        let variance = (f64::from(chosen.variance[i]) * per_unit).max(1e-10);
        Some(Averaged { v: trend_v + f64::from(chosen.value[i]) - skew, slope, variance })
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

impl Window {
    fn new(half_length: usize, correlations: &[f64; MAX_LAG + 1]) -> Self {
        let reach = (half_length + 1) as f64;
        let xs: Vec<f64> = (0..=2 * half_length).map(|k| (k as f64 - half_length as f64) / reach).collect();
        let moments = xs
            .iter()
            .map(|x| std::array::from_fn(|power| ((1.0 - x * x) * x.powi(power as i32)) as f32))
            .collect();
        let mut shared = Vec::with_capacity((half_length + 1) * (half_length + 1));
        for before in 0..=half_length {
            for after in 0..=half_length {
                let places = &xs[half_length - before..=half_length + after];
                shared.push(shared_noise(places, correlations) as f32);
            }
        }
        Self { half_length, moments, shared }
    }

    fn per_px(&self) -> f32 {
        1.0 / (self.half_length + 1) as f32
    }

    /// Factor on the variance for column `idx` of `n`.
    #[inline(always)]
    fn shared_at(&self, idx: usize, n: usize) -> f32 {
        let before = idx.min(self.half_length);
        let after = n.saturating_sub(idx + 1).min(self.half_length);
        self.shared[before * (self.half_length + 1) + after]
    }

    /// Fits eight parabolas; `weights` and `rows` begin at the first place of the first window.
    #[inline(always)]
    fn fit(&self, weights: &[f32], rows: &[f32]) -> Fits {
        let (mut s, mut t) = ([[0.0f32; LANES]; 5], [[0.0f32; LANES]; 3]);
        let windows = weights.windows(LANES).zip(rows.windows(LANES));
        for (m, (w, y)) in self.moments.iter().zip(windows) {
            let (Some(w), Some(y)) = (w.first_chunk::<LANES>(), y.first_chunk::<LANES>()) else { continue };
            let wy: Lanes = std::array::from_fn(|i| w[i] * y[i]);
            s[0] = plus_scaled(s[0], w, m[0]);
            s[1] = plus_scaled(s[1], w, m[1]);
            s[2] = plus_scaled(s[2], w, m[2]);
            s[3] = plus_scaled(s[3], w, m[3]);
            s[4] = plus_scaled(s[4], w, m[4]);
            t[0] = plus_scaled(t[0], &wy, m[0]);
            t[1] = plus_scaled(t[1], &wy, m[1]);
            t[2] = plus_scaled(t[2], &wy, m[2]);
        }
        solved(&s, &t)
    }
}

/// sum + lanes · factor.
#[inline(always)]
fn plus_scaled(mut sum: Lanes, lanes: &Lanes, factor: f32) -> Lanes {
    for i in 0..LANES {
        sum[i] += lanes[i] * factor;
    }
    sum
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

/// Variance of the value at x = 0 of a tapered parabola through evenly noisy places with shared noise, over what the
/// inverse of the normal matrix says.
fn shared_noise(places: &[f64], correlations: &[f64; MAX_LAG + 1]) -> f64 {
    let mut s = [0.0f64; 5];
    for x in places {
        (0..5).for_each(|power| s[power] += (1.0 - x * x) * x.powi(power as i32));
    }
    let first = [s[2] * s[4] - s[3] * s[3], s[2] * s[3] - s[1] * s[4], s[1] * s[3] - s[2] * s[2]];
    let determinant = s[0] * first[0] + s[1] * first[1] + s[2] * first[2];
    if determinant <= f64::from(MIN_DETERMINANT) * s[0] * s[2] * s[4] {
        return 1.0;
    }
    let kernel: Vec<f64> =
        places.iter().map(|x| (1.0 - x * x) * (first[0] + x * (first[1] + x * first[2])) / determinant).collect();
    let products = |lag: usize| kernel.iter().zip(kernel.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
    let sum = products(0) + (1..=MAX_LAG).map(|lag| 2.0 * correlations[lag] * products(lag)).sum::<f64>();
    sum * determinant / first[0]
}

/// How far (rows) the centre of a column's profile lies from a line that is steep and curved at once: to first order
/// in the curvature v″ it is 3/2 · v″ · m² / (1 + m²)² · s², m the slope and s² the variance of profile times window.
#[inline(always)]
fn skew_shift(slope: f64, curvature: f64, cross_variance_px2: f64) -> f64 {
    let steep = slope * slope;
    1.5 * curvature * steep / ((1.0 + steep) * (1.0 + steep)) * cross_variance_px2
}
