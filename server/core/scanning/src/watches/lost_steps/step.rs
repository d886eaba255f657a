//! The step of the lag at a frame: least squares over the differences of all pairs of orders in all bins.
//!
//! In bin k, order b differs from order a by d = c_bk − c_ak + g·(δ·[across the step] + ε·travel_ba) + noise, with the
//! slope g. The c and ε are fitted together with δ: what they take of its information is lost, and what remains does not
//! depend on them.
//!
//! Names of regressors and observation: X, the slope where the step counts, otherwise 0; H, the slope times the travel; D,
//! the difference in depth.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::params::lost_steps::{MIN_EFFECTIVE_BINS, OFFSET_PRIOR_RELATIVE, SCALE_PRIOR};
use crate::watches::lost_steps::series::{Series, Sums};

/// The fit of one bin without a step.
struct BinFit {
    /// The normal equations of the constants, factored.
    factor: Cholesky<f64, Dyn>,
    /// Per order: what its constant takes of H and of D.
    constants: [DVector<f64>; 2],
    /// Sums of products of H and D without the constants: H·H, H·D.
    hh: f64,
    hd: f64,
}

impl BinFit {
    /// `pairs`: sums over all differences, by pair. `None` without differences.
    fn new(pairs: &[Sums], travels_mm: &[f64], n_orders: usize, offset_weight: f64) -> Option<Self> {
        let mut normal = DMatrix::from_diagonal_element(n_orders, n_orders, offset_weight);
        let (mut of_h, mut of_d) = (DVector::zeros(n_orders), DVector::zeros(n_orders));
        let (mut hh, mut hd, mut dd) = (0.0, 0.0, 0.0);
        for (pair, (all, travel_mm)) in pairs.iter().zip(travels_mm).enumerate() {
            if all.weight <= 0.0 {
                continue;
            }
            let (order, other) = (pair / n_orders, pair % n_orders);
            normal[(order, order)] += all.weight;
            normal[(other, other)] += all.weight;
            normal[(order, other)] -= all.weight;
            normal[(other, order)] -= all.weight;
            for (right, sum) in [(&mut of_h, travel_mm * all.slope), (&mut of_d, all.depth)] {
                right[order] += sum;
                right[other] -= sum;
            }
            hh += travel_mm * travel_mm * all.slope_slope;
            hd += travel_mm * all.slope_depth;
            dd += all.depth_depth;
        }
        let factor = Cholesky::new(normal)?;
        let constants = [factor.solve(&of_h), factor.solve(&of_d)];
        hh -= of_h.dot(&constants[0]);
        hd -= of_h.dot(&constants[1]);
        dd -= of_d.dot(&constants[1]);
        (dd > 0.0).then_some(Self { factor, constants, hh, hd })
    }

    /// With a step. `pairs`: sums over the differences across it, by pair; `None` without any.
    fn with_step(&self, pairs: impl Iterator<Item = Sums>, travels_mm: &[f64]) -> Option<BinStep> {
        let n_orders = self.constants[0].len();
        let mut of_x = DVector::zeros(n_orders);
        let (mut xx, mut xh, mut xd) = (0.0, 0.0, 0.0);
        let mut is_empty = true;
        for (pair, (part, travel_mm)) in pairs.zip(travels_mm).enumerate() {
            if part.weight <= 0.0 {
                continue;
            }
            is_empty = false;
            of_x[pair / n_orders] += part.slope;
            of_x[pair % n_orders] -= part.slope;
            xx += part.slope_slope;
            xh += travel_mm * part.slope_slope;
            xd += part.slope_depth;
        }
        if is_empty {
            return None;
        }
        let constants = self.factor.solve(&of_x);
        xx -= of_x.dot(&constants);
        xh -= of_x.dot(&self.constants[0]);
        xd -= of_x.dot(&self.constants[1]);
        Some(BinStep { constants, xx, xh, xd })
    }
}

/// The fit of one bin with a step.
struct BinStep {
    /// Per order: what its constant takes of X.
    constants: DVector<f64>,
    /// Sums of products of X with X, H and D without the constants.
    xx: f64,
    xh: f64,
    xd: f64,
}

/// What the fits of all possible steps have in common: everything but X.
pub struct Steps<'a> {
    pairs: &'a [Vec<Series>],
    n_orders: usize,
    travels_mm: Vec<f64>,
    bins: Vec<Option<BinFit>>,
    /// Sums of H·H and H·D over all bins; H·H includes the prior of the scale.
    hh: f64,
    hd: f64,
    /// Variance of a difference of weight 1.
    variance: f64,
}

impl<'a> Steps<'a> {
    /// `None` if the differences do not scatter. `pairs`: by pair of orders (order · number of orders + other), then bin;
    /// `depth_mm`: of the calibrated range.
    pub fn new(pairs: &'a [Vec<Series>], n_orders: usize, depth_mm: f64) -> Option<Self> {
        let n_bins = pairs.first()?.len();
        let all: Vec<Vec<Sums>> = pairs.iter().map(|bins| bins.iter().map(Series::all).collect()).collect();
        let (mut squares, mut n) = (0.0, 0.0);
        for sums in all.iter().flatten().filter(|sums| sums.n >= 2.0) {
            squares += sums.depth_depth - sums.depth * sums.depth / sums.weight;
            n += sums.n - 1.0;
        }
        let variance = squares / n;
        if variance.is_nan() || variance <= 0.0 {
            return None;
        }
        let travel_mm = |bins: &Vec<Sums>| {
            let (n, travel) = bins.iter().fold((0.0, 0.0), |(n, travel), of| (n + of.n, travel + of.travel));
            if n > 0.0 { travel / n } else { 0.0 }
        };
        let travels_mm: Vec<f64> = all.iter().map(travel_mm).collect();
        let offset_weight = variance / (OFFSET_PRIOR_RELATIVE * depth_mm).powi(2);
        let bin = |bin: usize| {
            let sums: Vec<Sums> = all.iter().map(|of_bins| of_bins[bin]).collect();
            BinFit::new(&sums, &travels_mm, n_orders, offset_weight)
        };
        let bins: Vec<Option<BinFit>> = (0..n_bins).map(bin).collect();
        let hh = bins.iter().flatten().map(|of| of.hh).sum::<f64>() + variance / SCALE_PRIOR.powi(2);
        let hd = bins.iter().flatten().map(|of| of.hd).sum();
        Some(Self { pairs, n_orders, travels_mm, bins, hh, hd, variance })
    }

    /// The step at a frame; `None` if it is not determined.
    pub fn at(&self, first_frame: usize) -> Option<Step<'_>> {
        let bin = |(bin, fit): (usize, &Option<BinFit>)| {
            let parts = self.pairs.iter().map(|series| series[bin].across(first_frame));
            fit.as_ref()?.with_step(parts, &self.travels_mm)
        };
        let bins: Vec<Option<BinStep>> = self.bins.iter().enumerate().map(bin).collect();
        let sum = |of: fn(&BinStep) -> f64| bins.iter().flatten().map(of).sum::<f64>();
        let (xx, xh, xd) = (sum(|bin| bin.xx), sum(|bin| bin.xh), sum(|bin| bin.xd));
        let share = xh / self.hh;
        let information = xx - share * xh;
        if information <= 0.0 {
            return None;
        }
        let lag_mm = (xd - share * self.hd) / information;
        let scale = (self.hd - lag_mm * xh) / self.hh;
        Some(Step { common: self, first_frame, bins, lag_mm, scale, share, information })
    }
}

/// The step at a frame.
pub struct Step<'a> {
    common: &'a Steps<'a>,
    first_frame: usize,
    bins: Vec<Option<BinStep>>,
    /// The step, mm.
    pub lag_mm: f64,
    /// Relative error of the stage's scale.
    scale: f64,
    /// What the scale takes of X.
    share: f64,
    information: f64,
}

impl Step<'_> {
    /// Its standard deviation if all differences were independent.
    pub fn independent_sigma_mm(&self) -> f64 {
        (self.common.variance / self.information).sqrt()
    }

    /// Its variance from the scatter of the differences, relative to that of independent ones, at least 1; `None` if too few
    /// bins determine the step. `positions_mm`: stated, of the frames from `oldest` on, the first with differences;
    /// `shared_mm`: travel over which differences may share their noise.
    pub fn design_effect(&self, (oldest, positions_mm): (usize, &[f64]), shared_mm: f64) -> Option<f64> {
        let (mut along, mut across, mut squares) = (0.0, 0.0, 0.0);
        let mut scores = vec![0.0; positions_mm.len()];
        for (bin, fit) in self.common.bins.iter().enumerate() {
            let Some(fit) = fit else { continue };
            scores.fill(0.0);
            self.add_scores(bin, fit, (oldest, &mut scores));
            along += shared_variance(&scores, positions_mm, shared_mm);
            let (xx, xh) = self.bins[bin].as_ref().map_or((0.0, 0.0), |step| (step.xx, step.xh));
            let information = xx - 2.0 * self.share * xh + self.share * self.share * fit.hh;
            // Without the bin, the step would change by score / (information − its own): the jackknife.
            let others = (self.information - information).max(f64::MIN_POSITIVE);
            across += (scores.iter().sum::<f64>() / others).powi(2);
            squares += (information / self.information).powi(2);
        }
        let variance = (along / self.information.powi(2)).max(across);
        let relative = variance * self.information / self.common.variance;
        (squares * MIN_EFFECTIVE_BINS <= 1.0).then(|| relative.max(1.0))
    }

    /// Adds the contributions of a bin to the step, by frame from `oldest` on, times the information.
    fn add_scores(&self, bin: usize, fit: &BinFit, (oldest, scores): (usize, &mut [f64])) {
        let Steps { pairs, travels_mm, n_orders, .. } = self.common;
        let [of_h, of_d] = &fit.constants;
        let of_x = self.bins[bin].as_ref().map(|step| &step.constants);
        for (pair, (series, travel_mm)) in pairs.iter().zip(travels_mm).enumerate() {
            let (order, other) = (pair / n_orders, pair % n_orders);
            let difference = |of: &DVector<f64>| of[order] - of[other];
            let (x_mean, h_mean, d_mean) = (of_x.map_or(0.0, difference), difference(of_h), difference(of_d));
            for difference in series[bin].iter() {
                let counts = difference.frame >= self.first_frame && difference.reference < self.first_frame;
                let slope = if counts { difference.slope } else { 0.0 };
                let x = slope - x_mean;
                let h = travel_mm * difference.slope - h_mean;
                let residual = difference.depth_mm - d_mean - self.lag_mm * x - self.scale * h;
                scores[difference.frame - oldest] += difference.weight * (x - self.share * h) * residual;
            }
        }
    }
}

/// Variance of the sum of scores that share noise with others within `shared_mm`, the less the farther they are apart
/// (Newey, West, Econometrica 55 (1987) 703).
fn shared_variance(scores: &[f64], positions_mm: &[f64], shared_mm: f64) -> f64 {
    let mut variance = 0.0;
    for (frame, score) in scores.iter().enumerate().filter(|(_, score)| **score != 0.0) {
        variance += score * score;
        for (other, position_mm) in scores[frame + 1..].iter().zip(&positions_mm[frame + 1..]) {
            let weight = 1.0 - (position_mm - positions_mm[frame]).abs() / shared_mm;
            if weight <= 0.0 {
                break;
            }
            variance += 2.0 * weight * score * other;
        }
    }
    variance
}
