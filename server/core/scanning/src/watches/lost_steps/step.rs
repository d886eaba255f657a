//! The step of the lag at a frame: least squares over the differences of all pairs of orders in all bins.
//!
//! In bin k, order b differs from order a by d = c_bk − c_ak + g·(δ·[across the step] + ε·travel_ba) + noise, with the
//! slope g. The c and ε are fitted together with δ: what they take of its information is lost, and what remains does not
//! depend on them.

use nalgebra::{Cholesky, DMatrix};

use crate::params::lost_steps::{MIN_EFFECTIVE_BINS, OFFSET_PRIOR_RELATIVE, SCALE_PRIOR};
use crate::watches::lost_steps::series::{Series, Sums};

/// Regressors and observation: the slope where the step counts, otherwise 0; the slope times the travel; the difference in
/// depth.
const X: usize = 0;
const H: usize = 1;
const D: usize = 2;

/// The fit of one bin.
struct BinFit {
    /// Per order (rows): what its constant takes of X, H and D.
    constants: DMatrix<f64>,
    /// Sums of products of X, H and D without the constants.
    products: [[f64; 3]; 3],
}

impl BinFit {
    /// `pairs`: sums over all differences, and over those across the step, by pair. `None` without differences.
    fn new(pairs: &[(Sums, Sums)], travels_mm: &[f64], n_orders: usize, offset_weight: f64) -> Option<Self> {
        let mut normal = DMatrix::from_diagonal_element(n_orders, n_orders, offset_weight);
        let mut right = DMatrix::zeros(n_orders, 3);
        let mut products = [[0.0; 3]; 3];
        for (pair, ((all, part), travel_mm)) in pairs.iter().zip(travels_mm).enumerate() {
            if all.weight <= 0.0 {
                continue;
            }
            let (order, other) = (pair / n_orders, pair % n_orders);
            normal[(order, order)] += all.weight;
            normal[(other, other)] += all.weight;
            normal[(order, other)] -= all.weight;
            normal[(other, order)] -= all.weight;
            for (column, sum) in [part.slope, travel_mm * all.slope, all.depth].into_iter().enumerate() {
                right[(order, column)] += sum;
                right[(other, column)] -= sum;
            }
            products[X][X] += part.slope_slope;
            products[X][H] += travel_mm * part.slope_slope;
            products[X][D] += part.slope_depth;
            products[H][H] += travel_mm * travel_mm * all.slope_slope;
            products[H][D] += travel_mm * all.slope_depth;
            products[D][D] += all.depth_depth;
        }
        let constants = Cholesky::new(normal)?.solve(&right);
        let taken = right.tr_mul(&constants);
        for (row, column) in [(X, X), (X, H), (X, D), (H, H), (H, D), (D, D)] {
            products[row][column] -= taken[(row, column)];
        }
        (products[D][D] > 0.0).then_some(Self { constants, products })
    }
}

/// The step at a frame.
pub struct Step<'a> {
    pairs: &'a [Vec<Series>],
    n_orders: usize,
    first_frame: usize,
    travels_mm: Vec<f64>,
    bins: Vec<Option<BinFit>>,
    /// The step, mm.
    pub lag_mm: f64,
    /// Relative error of the stage's scale.
    scale: f64,
    /// What the scale takes of X.
    share: f64,
    information: f64,
    /// Variance of a difference of weight 1.
    variance: f64,
}

impl<'a> Step<'a> {
    /// `None` if it is not determined. `pairs`: by pair of orders (order · number of orders + other), then bin; `depth_mm`:
    /// of the calibrated range.
    pub fn at(pairs: &'a [Vec<Series>], n_orders: usize, first_frame: usize, depth_mm: f64) -> Option<Self> {
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
            let sums = |(all, series): (&Vec<Sums>, &Vec<Series>)| (all[bin], series[bin].across(first_frame));
            let sums: Vec<(Sums, Sums)> = all.iter().zip(pairs).map(sums).collect();
            BinFit::new(&sums, &travels_mm, n_orders, offset_weight)
        };
        let bins: Vec<Option<BinFit>> = (0..n_bins).map(bin).collect();
        let sum =
            |row: usize, column: usize| bins.iter().flatten().map(|of| of.products[row][column]).sum::<f64>();
        let (xh, hh) = (sum(X, H), sum(H, H) + variance / SCALE_PRIOR.powi(2));
        let share = xh / hh;
        let information = sum(X, X) - share * xh;
        if information <= 0.0 {
            return None;
        }
        let lag_mm = (sum(X, D) - share * sum(H, D)) / information;
        let scale = (sum(H, D) - lag_mm * xh) / hh;
        Some(Self { pairs, n_orders, first_frame, travels_mm, bins, lag_mm, scale, share, information, variance })
    }

    /// Its standard deviation if all differences were independent.
    pub fn independent_sigma_mm(&self) -> f64 {
        (self.variance / self.information).sqrt()
    }

    /// Its variance from the scatter of the differences, relative to that of independent ones, at least 1; `None` if too few
    /// bins determine the step. `positions_mm`: stated, by frame; `shared_mm`: travel over which differences may share their
    /// noise.
    pub fn design_effect(&self, positions_mm: &[f64], shared_mm: f64) -> Option<f64> {
        let (mut along, mut across, mut squares) = (0.0, 0.0, 0.0);
        let mut scores = vec![0.0; positions_mm.len()];
        for (bin, fit) in self.bins.iter().enumerate() {
            let Some(fit) = fit else { continue };
            scores.fill(0.0);
            self.add_scores(bin, fit, &mut scores);
            along += shared_variance(&scores, positions_mm, shared_mm);
            let [[xx, xh, _], [_, hh, _], _] = fit.products;
            let information = xx - 2.0 * self.share * xh + self.share * self.share * hh;
            // Without the bin, the step would change by score / (information − its own): the jackknife.
            let others = (self.information - information).max(f64::MIN_POSITIVE);
            across += (scores.iter().sum::<f64>() / others).powi(2);
            squares += (information / self.information).powi(2);
        }
        let variance = (along / self.information.powi(2)).max(across);
        let relative = variance * self.information / self.variance;
        (squares * MIN_EFFECTIVE_BINS <= 1.0).then(|| relative.max(1.0))
    }

    /// Adds the contributions of a bin to the step, by frame, times the information.
    fn add_scores(&self, bin: usize, fit: &BinFit, scores: &mut [f64]) {
        for (pair, (series, travel_mm)) in self.pairs.iter().zip(&self.travels_mm).enumerate() {
            let (order, other) = (pair / self.n_orders, pair % self.n_orders);
            let [x_mean, h_mean, d_mean] =
                [X, H, D].map(|column| fit.constants[(order, column)] - fit.constants[(other, column)]);
            for difference in series[bin].iter() {
                let counts = difference.frame >= self.first_frame && difference.reference < self.first_frame;
                let slope = if counts { difference.slope } else { 0.0 };
                let x = slope - x_mean;
                let h = travel_mm * difference.slope - h_mean;
                let residual = difference.depth_mm - d_mean - self.lag_mm * x - self.scale * h;
                scores[difference.frame] += difference.weight * (x - self.share * h) * residual;
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
