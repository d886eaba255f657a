//! Noise of the crossings: camera noise is predicted, speckle is estimated from the crossings themselves.
//!
//! The variance of a crossing is modelled as camera + speckle² · c, both propagated through its weights (see
//! [`Crossing`]). The one factor c (contrast² × grain) depends on the surface and the lens and is estimated from third
//! differences at a lag longer than the grain, which vanish for any parabola.

use super::crossing::{Crossing, Line};
use crate::params::{
    SCATTER_CLIP, SCATTER_LAG, SCATTER_MAX_SAMPLES, SCATTER_MIN_SAMPLES, SCATTER_SHORT_LAG, SPECKLE_PRIOR,
};

/// Mean of min(χ²₁, 9): what [`SCATTER_CLIP`] leaves of the square of a unit Gaussian.
const CLIPPED_MEAN: f64 = 0.995;
/// Coefficients of the third difference.
const THIRD: [f64; 4] = [1.0, -3.0, 3.0, -1.0];

/// The noise of an image's crossings.
#[derive(Debug, Clone, Copy)]
pub struct Scatter {
    /// Squared speckle contrast times grain, px.
    speckle: f64,
    /// The correlation ρ of neighbouring columns; of columns k apart it is ρ^(k²), a Gaussian.
    neighbours: f64,
}

/// Squared third differences of neighbouring columns, with the model's prediction for each if neighbours were
/// independent. Lanes without a difference have a zero square and a non-zero prediction.
#[derive(Debug, Clone, Copy)]
pub struct ThirdDifferences {
    /// Squares, px².
    pub square: Lanes,
    /// Predicted for camera noise, px².
    pub camera: Lanes,
    /// Predicted for speckle, px² per unit of squared contrast times grain.
    pub speckle: Lanes,
}

/// The third differences of an image's lines at a long and a short lag; their memory is reused from image to image.
#[derive(Default)]
pub struct Differences {
    long: Samples,
    short: Samples,
}

/// Differences at one lag.
#[derive(Default)]
struct Samples {
    blocks: Vec<ThirdDifferences>,
    n: usize,
}

/// Neighbouring columns in a block.
pub const LANES: usize = 8;
type Lanes = [f32; LANES];

impl Scatter {
    /// Measures the scatter. `grain_min_px` is the correlation length of the smoothing along the line that was applied
    /// to the crossings.
    #[inline(always)]
    pub fn measure<L: Line>(
        lines: impl Iterator<Item = L> + Clone,
        grain_min_px: f64,
        differences: &mut Differences,
    ) -> Self {
        let Differences { long, short } = differences;
        long.take(lines.clone(), SCATTER_LAG);
        short.take(lines, SCATTER_SHORT_LAG);
        let least = neighbours_of_grain(grain_min_px.max(0.5));
        let prior = Self { speckle: SPECKLE_PRIOR, neighbours: least };
        if long.n < SCATTER_MIN_SAMPLES {
            return prior;
        }
        let apparent = long.speckle_factor(1.0);
        let ratio = short.excess(apparent) / long.excess(apparent).max(1e-9);
        let neighbours = neighbours_of_ratio(ratio, least);
        Self { speckle: long.speckle_factor(third_difference_gain(SCATTER_LAG, neighbours)), neighbours }
    }

    /// Squared speckle contrast times grain, px: the factor of every crossing's speckle variance.
    pub fn speckle(&self) -> f64 {
        self.speckle
    }

    /// Variance (px²) of one crossing along its column.
    pub fn variance(&self, crossing: &Crossing) -> f64 {
        crossing.camera_variance + self.speckle * crossing.speckle_variance
    }

    /// Correlation of the noise of two crossings `columns` apart.
    pub fn correlation(&self, columns: usize) -> f64 {
        self.neighbours.powi((columns * columns) as i32)
    }

    /// Σ ρ over all lags: columns per independent crossing.
    pub fn correlation_px(&self) -> f64 {
        (1.0 + 2.0 * (1..32).map(|k| self.correlation(k)).sum::<f64>()).max(1.0)
    }
}

impl Default for ThirdDifferences {
    fn default() -> Self {
        Self { square: [0.0; LANES], camera: [1.0; LANES], speckle: [0.0; LANES] }
    }
}

impl ThirdDifferences {
    /// Sets the difference that begins at one column.
    #[inline(always)]
    pub fn set<L: Line + ?Sized>(&mut self, lane: usize, line: &L, start: usize, lag: usize) {
        let (mut difference, mut camera, mut speckle) = (0.0, 0.0, 0.0);
        for (k, factor) in THIRD.into_iter().enumerate() {
            let crossing = line.at(start + k * lag);
            difference += factor * crossing.v;
            camera += factor * factor * crossing.camera_variance;
            speckle += factor * factor * crossing.speckle_variance;
        }
        self.square[lane] = (difference * difference) as f32;
        self.camera[lane] = camera as f32;
        self.speckle[lane] = speckle as f32;
    }
}

impl Samples {
    /// Third differences of all lines in blocks of neighbouring columns, thinned evenly to about
    /// [`SCATTER_MAX_SAMPLES`].
    #[inline(always)]
    fn take<L: Line>(&mut self, lines: impl Iterator<Item = L> + Clone, lag: usize) {
        let n_of = |line: &L| line.n_columns().saturating_sub(3 * lag);
        let available: usize = lines.clone().map(|line| n_of(&line)).sum();
        let stride = LANES * available.div_ceil(SCATTER_MAX_SAMPLES).max(1);
        self.blocks.clear();
        self.n = 0;
        for line in lines {
            for start in (0..n_of(&line)).step_by(stride) {
                self.n += LANES.min(n_of(&line) - start);
                self.blocks.push(if start + LANES <= n_of(&line) {
                    line.third_differences(start, lag)
                } else {
                    let mut some = ThirdDifferences::default();
                    (start..n_of(&line)).for_each(|idx| some.set(idx - start, &line, idx, lag));
                    some
                });
            }
        }
    }

    /// Mean of the squares over the prediction from camera noise and speckle times `gain`, each clipped at
    /// [`SCATTER_CLIP`], minus the value for unit Gaussians.
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "lane by lane is what compilers turn into vectors")]
    fn clipped_excess(&self, speckle: f64, gain: f64) -> f64 {
        let (speckle, gain) = (speckle as f32, gain as f32);
        let mut sums: Lanes = [0.0; LANES];
        for block in &self.blocks {
            for i in 0..LANES {
                let normalised = block.square[i] / (gain * (block.camera[i] + speckle * block.speckle[i]));
                sums[i] += normalised.min(SCATTER_CLIP);
            }
        }
        f64::from(sums.iter().sum::<f32>()) / self.n.max(1) as f64 - CLIPPED_MEAN
    }

    /// The speckle factor for which the squares match unit Gaussians; zero if camera noise explains them.
    #[inline(always)]
    fn speckle_factor(&self, gain: f64) -> f64 {
        const LEAST: f64 = 1e-5;
        if self.clipped_excess(LEAST, gain) <= 0.0 {
            return 0.0;
        }
        let mut search = RootSearch::about(SPECKLE_PRIOR.ln(), LEAST.ln(), 1e2f64.ln());
        while let Some(speckle) = search.next() {
            search.add_value(self.clipped_excess(speckle.exp(), gain));
        }
        search.found.exp()
    }

    /// The factor by which the squares exceed those of unit Gaussians.
    #[inline(always)]
    fn excess(&self, speckle: f64) -> f64 {
        let mut search = RootSearch::about(0.0, 1e-4f64.ln(), 1e2f64.ln());
        while let Some(factor) = search.next() {
            search.add_value(self.clipped_excess(speckle, factor.exp()));
        }
        search.found.exp()
    }
}

/// Root search for a decreasing function: steps from an initial guess until the sign changes, then the Illinois variant
/// of regula falsi, which keeps the root bracketed and halves the weight of the end that is retained. The caller
/// evaluates the function, because a closure passed in would not be vectorised.
struct RootSearch {
    /// Limits of the search.
    limits: (f64, f64),
    /// The nearest known points on either side of the root, with their function values.
    before: Option<(f64, f64)>,
    after: Option<(f64, f64)>,
    found: f64,
    n_steps: usize,
    done: bool,
}

impl RootSearch {
    /// The search ends with a smaller step: logarithms to a thousandth.
    const TOLERANCE: f64 = 1e-3;
    /// The first steps from the guess: a factor of two.
    const STRIDE: f64 = std::f64::consts::LN_2;
    const MAX_STEPS: usize = 40;

    fn about(guess: f64, low: f64, high: f64) -> Self {
        Self { limits: (low, high), before: None, after: None, found: guess, n_steps: 0, done: false }
    }

    /// The next point at which the function must be evaluated; `None` when the root is found.
    fn next(&mut self) -> Option<f64> {
        let last = self.found;
        self.found = match (self.before, self.after) {
            (None, None) => last,
            (Some((place, _)), None) => (place + self.stride()).min(self.limits.1),
            (None, Some((place, _))) => (place - self.stride()).max(self.limits.0),
            (Some((low, at_low)), Some((high, at_high))) => (low * at_high - high * at_low) / (at_high - at_low),
        };
        // At a limit without a change of sign the root lies beyond.
        self.done |= self.n_steps == Self::MAX_STEPS || self.n_steps > 0 && self.found == last;
        if self.done {
            return None;
        }
        self.done = self.n_steps > 0 && (self.found - last).abs() < Self::TOLERANCE;
        self.n_steps += 1;
        Some(self.found)
    }

    /// Strides double, so that a distant root is reached quickly.
    fn stride(&self) -> f64 {
        Self::STRIDE * f64::from(1u32 << self.n_steps.clamp(1, 16) as u32 >> 1)
    }

    /// Records the function value at the current point.
    fn add_value(&mut self, value: f64) {
        let here = Some((self.found, value));
        let halved = |end: Option<(f64, f64)>| end.map(|(place, value)| (place, 0.5 * value));
        let is_between = self.before.is_some() && self.after.is_some();
        if value > 0.0 {
            self.before = here;
            self.after = if is_between { halved(self.after) } else { self.after };
        } else {
            self.after = here;
            self.before = if is_between { halved(self.before) } else { self.before };
        }
    }
}

/// The correlation of neighbouring columns for a grain of ℓ columns: ρ(k) = exp(−k² / 4ℓ²).
fn neighbours_of_grain(grain_px: f64) -> f64 {
    (-1.0 / (4.0 * grain_px * grain_px)).exp()
}

/// Variance of a third difference at `lag` relative to independent noise.
fn third_difference_gain(lag: usize, neighbours: f64) -> f64 {
    let rho = |steps: usize| neighbours.powi((steps * lag * steps * lag) as i32);
    (20.0 - 30.0 * rho(1) + 12.0 * rho(2) - 2.0 * rho(3)) / 20.0
}

/// The neighbour correlation, `least` or more, at which the short lag shows `ratio` of the long lag's variance.
fn neighbours_of_ratio(ratio: f64, least: f64) -> f64 {
    /// Largest grain accepted, px.
    const MOST_GRAIN_PX: f64 = 3.0;
    let (mut low, mut high) = (least, neighbours_of_grain(MOST_GRAIN_PX));
    let predicted = |neighbours: f64| {
        third_difference_gain(SCATTER_SHORT_LAG, neighbours) / third_difference_gain(SCATTER_LAG, neighbours)
    };
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if predicted(middle) > ratio { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
