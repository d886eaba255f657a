//! Least squares fit of differences between orders, with priors for some parameters.
//!
//! θ̂ = H⁻¹ Σ w a d with H = Σ w a aᵀ + P, where P holds 1 for parameters with a prior of 0 ± 1 and 0 for free ones.
//! Neighbouring differences share speckle and surface, so the covariance is H⁻¹ (B + P) H⁻¹ with B = Σ_c g_c g_cᵀ over
//! clusters c of neighbours, g_c = Σ w a r: noise shared within a cluster is accounted for (Liang, Zeger 1986).

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use statistics::{SIGMA_PER_MAD, median};

use crate::params::watches::{FIT_ROUNDS, OUTLIER_SIGMAS, SHARED_DIFFERENCES};

/// One difference between two orders at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Its derivative with respect to each parameter.
    pub by_parameters: Vec<f64>,
    /// The measured difference.
    pub value: f64,
    /// Differences with the same number share their noise.
    pub cluster: u64,
}

/// The result.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// The parameters.
    pub parameters: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom of their variances.
    pub degrees_of_freedom: DVector<f64>,
}

/// Differences that share their noise.
struct Cluster {
    /// Σ w a r.
    gradient: DVector<f64>,
    /// Σ w a aᵀ.
    normal: DMatrix<f64>,
}

impl Cluster {
    fn none(n: usize) -> Self {
        Self { gradient: DVector::zeros(n), normal: DMatrix::zeros(n, n) }
    }
}

/// Fits the parameters `chosen` of `differences`; those with `known` have a prior of 0 ± 1. `None` if there are
/// too few clusters, or the parameters are not determined.
pub fn fit(differences: &[Difference], chosen: &[usize], known: &[bool]) -> Option<Fitted> {
    let n = chosen.len();
    let rows: Vec<DVector<f64>> = differences
        .iter()
        .map(|of| DVector::from_iterator(n, chosen.iter().map(|idx| of.by_parameters[*idx])))
        .collect();
    let prior = DMatrix::from_diagonal(&DVector::from_iterator(
        n,
        chosen.iter().map(|idx| if known[*idx] { 1.0 } else { 0.0 }),
    ));
    let mut residuals: Vec<f64> = differences.iter().map(|of| of.value).collect();
    let (mut parameters, mut inverse, mut weights) = (DVector::zeros(n), DMatrix::zeros(n, n), Vec::new());
    for _ in 0..FIT_ROUNDS {
        // Without any noise all weights are equal.
        let scale = SIGMA_PER_MAD * median(&mut residuals.iter().map(|r| r.abs()).collect::<Vec<_>>())?;
        let variance = scale.powi(2).max(f64::MIN_POSITIVE) * SHARED_DIFFERENCES;
        let weight = |r: &f64| if r.abs() <= OUTLIER_SIGMAS * scale { 1.0 / variance } else { 0.0 };
        weights = residuals.iter().map(weight).collect();
        let (mut normal, mut right) = (prior.clone(), DVector::zeros(n));
        for ((row, of), weight) in rows.iter().zip(differences).zip(&weights) {
            normal.ger(*weight, row, row, 1.0);
            right.axpy(weight * of.value, row, 1.0);
        }
        inverse = normal.cholesky()?.inverse();
        parameters = &inverse * right;
        residuals = rows.iter().zip(differences).map(|(row, of)| of.value - row.dot(&parameters)).collect();
    }
    let mut clusters: BTreeMap<u64, Cluster> = BTreeMap::new();
    for (((row, of), weight), residual) in rows.iter().zip(differences).zip(&weights).zip(&residuals) {
        let cluster = clusters.entry(of.cluster).or_insert_with(|| Cluster::none(n));
        cluster.gradient.axpy(weight * residual, row, 1.0);
        cluster.normal.ger(*weight, row, row, 1.0);
    }
    let n_free = chosen.iter().filter(|idx| !known[**idx]).count();
    if clusters.len() < 2 * n_free + 2 {
        return None;
    }
    let mut noise = DMatrix::zeros(n, n);
    let mut squares = DVector::zeros(n);
    for cluster in clusters.values() {
        // Without the cluster, the parameters would change by this: the jackknife.
        let others = DMatrix::identity(n, n) - &inverse * &cluster.normal;
        let change = others.lu().solve(&(&inverse * &cluster.gradient))?;
        noise.ger(1.0, &change, &change, 1.0);
        squares += (&inverse * &cluster.normal * &inverse).diagonal().map(|share| share * share);
    }
    let by_prior = &inverse * &prior * &inverse;
    let degrees_of_freedom = DVector::from_fn(n, |idx, _| {
        let n_effective = (inverse[(idx, idx)] - by_prior[(idx, idx)]).powi(2) / squares[idx];
        // Only the noise is estimated (Satterthwaite).
        (n_effective - 1.0) * (1.0 + by_prior[(idx, idx)] / noise[(idx, idx)]).powi(2)
    });
    Some(Fitted { parameters, covariance: noise + by_prior, degrees_of_freedom })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fixed sequence of numbers between −½ and ½.
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_add(0x9E37_79B9);
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        }
    }

    #[test]
    fn sigma_accounts_for_shared_noise_and_priors() {
        // One free parameter of 2, one with a prior of ±1; groups of ten neighbours share their noise.
        let (mut squares, n_tries) = (0.0, 400);
        for seed in 0..n_tries {
            let mut next = noise(seed);
            let known = 12f64.sqrt() * next();
            let mut differences = Vec::new();
            for cluster in 0..60u64 {
                let (slope, shared) = (next(), 0.2 * next());
                for _ in 0..10 {
                    let by_parameters = vec![1.0 + slope, 0.3 * slope];
                    let value = 2.0 * by_parameters[0] + known * by_parameters[1] + shared + 0.02 * next();
                    differences.push(Difference { by_parameters, value, cluster });
                }
            }
            let fitted = fit(&differences, &[0, 1], &[false, true]).unwrap();
            squares += (fitted.parameters[0] - 2.0).powi(2) / fitted.covariance[(0, 0)];
        }
        let ratio = (squares / n_tries as f64).sqrt();
        // 400 tries leave 3.5 %, 60 clusters a little more.
        assert!((0.9..1.1).contains(&ratio), "{ratio}");
    }
}
