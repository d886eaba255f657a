//! σ within: the short-term scatter, without drifts and steps between points.

use std::f64::consts::{FRAC_2_PI, PI};

use crate::control_constants::c4;
use crate::sample::{mean, std_dev, valid};

/// How consecutive values belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grouping {
    /// Individual values: σ from the differences of consecutive values.
    Individuals,
    /// Subgroups of consecutive values: σ from the standard deviations within them.
    Subgroups {
        /// Number of values in a subgroup, at least 2.
        size: usize,
    },
}

/// An estimate of σ from normal values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SigmaEstimate {
    /// Estimate of σ, in the unit of the values.
    pub sigma: f64,
    /// Equivalent degrees of freedom ν: the relative variance of the estimate is 1/(2ν), eq. (17) and (20).
    pub dof: f64,
    /// Number of moving ranges or subgroups used.
    pub n_used: usize,
}

/// σ within of a list of values, `None` if no range or complete subgroup is left between the gaps.
pub(super) fn sigma_within(values: &[Option<f64>], grouping: Grouping) -> Option<SigmaEstimate> {
    match grouping {
        Grouping::Individuals => sigma_from_moving_ranges(&moving_ranges(values)),
        Grouping::Subgroups { size } => {
            let deviations: Vec<f64> = subgroups(values, size).flatten().map(|(_, std_dev)| std_dev).collect();
            sigma_from_std_devs(&deviations, size)
        }
    }
}

/// Absolute difference of every value from the one before; a gap at the first value and beside every gap.
pub(super) fn moving_ranges(values: &[Option<f64>]) -> Vec<Option<f64>> {
    let pairs = values.windows(2).map(|pair| Some((valid(pair[1])? - valid(pair[0])?).abs()));
    (!values.is_empty()).then_some(None).into_iter().chain(pairs).collect()
}

/// Mean and standard deviation of every subgroup; `None` for one with a gap. Values after the last complete subgroup
/// are not included. `size` must be at least 1.
pub(super) fn subgroups(values: &[Option<f64>], size: usize) -> impl Iterator<Item = Option<(f64, f64)>> {
    values.chunks_exact(size).map(|subgroup| {
        let values: Vec<f64> = subgroup.iter().map(|value| valid(*value)).collect::<Option<_>>()?;
        Some((mean(&values), std_dev(&values)))
    })
}

/// σ = mean moving range / d2, eq. (14), with d2 = 2/√π for two values.
///
/// Consecutive ranges share a value and are correlated: with ρ = −½ between the two differences, the covariance of
/// their absolute values is (4/π)(√(1 − ρ²) + ρ·asin ρ − 1)·σ² (bivariate normal distribution), eq. (17).
fn sigma_from_moving_ranges(ranges: &[Option<f64>]) -> Option<SigmaEstimate> {
    let used: Vec<f64> = ranges.iter().copied().flatten().collect();
    let n_used = used.len();
    let n_adjacent = ranges.windows(2).filter(|pair| pair[0].is_some() && pair[1].is_some()).count();
    let d2_squared = 2.0 * FRAC_2_PI;
    let variance = 2.0 - d2_squared;
    let covariance = d2_squared * (0.75_f64.sqrt() + PI / 12.0 - 1.0);
    let n = n_used as f64;
    let relative_variance = (n * variance + 2.0 * n_adjacent as f64 * covariance) / (n * n * d2_squared);
    (n_used > 0).then(|| SigmaEstimate {
        sigma: mean(&used) / d2_squared.sqrt(),
        dof: 0.5 / relative_variance,
        n_used,
    })
}

/// σ = mean standard deviation / c4, eq. (19); relative variance (1 − c4²)/(k·c4²), eq. (20).
pub(super) fn sigma_from_std_devs(deviations: &[f64], size: usize) -> Option<SigmaEstimate> {
    let c4 = c4(size).filter(|_| !deviations.is_empty())?;
    let relative_variance = (1.0 - c4 * c4) / (deviations.len() as f64 * c4 * c4);
    Some(SigmaEstimate { sigma: mean(deviations) / c4, dof: 0.5 / relative_variance, n_used: deviations.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_removes_both_ranges_beside_it() {
        let values = [Some(1.0), Some(3.0), None, Some(4.0), Some(f64::NAN), Some(2.0), Some(7.0)];
        assert_eq!(moving_ranges(&values), [None, Some(2.0), None, None, None, None, Some(5.0)]);
    }

    #[test]
    fn a_subgroup_with_a_gap_and_an_incomplete_one_are_not_used() {
        let values = [Some(1.0), Some(3.0), None, Some(4.0), Some(5.0), Some(5.0), Some(9.0)];
        assert_eq!(
            subgroups(&values, 2).collect::<Vec<_>>(),
            [Some((2.0, 2.0_f64.sqrt())), None, Some((5.0, 0.0))]
        );
    }

    /// Palm & Wheeler: the variance of the estimate is (0.8264 n − 1.082)/(n − 1)² for n individual values.
    #[test]
    fn degrees_of_freedom_of_moving_ranges_are_those_of_palm_and_wheeler() {
        for n in [2.0_f64, 10.0, 100.0] {
            let values: Vec<Option<f64>> = (0..n as usize).map(|idx| Some(idx as f64)).collect();
            let dof = sigma_within(&values, Grouping::Individuals).unwrap().dof;
            let printed = (n - 1.0).powi(2) / (2.0 * (0.8264 * n - 1.082));
            assert!((dof / printed - 1.0).abs() < 1e-3, "n = {n}: {dof} is not {printed}"); // four printed digits
        }
    }
}
