//! Shewhart control charts.

use super::sigma::{Grouping, SigmaEstimate, moving_ranges, sigma_from_std_devs, sigma_within, subgroups};
use crate::control_constants::{a3, b3_b4, d2, d3};
use crate::params::{CONTROL_SIGMAS, MIN_PROCESS_VALUES};
use crate::sample::{mean, valid, valid_values};

/// Centre line and control limits, in the unit of the values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlLimits {
    /// Lower control limit.
    pub lower: f64,
    /// Centre line.
    pub centre: f64,
    /// Upper control limit.
    pub upper: f64,
}

/// Chart of individual values and moving ranges (I-MR).
#[derive(Debug, Clone, PartialEq)]
pub struct IndividualsChart {
    /// Number of valid values of the baseline.
    pub n: usize,
    /// Number of gaps in the baseline.
    pub n_missing: usize,
    /// Whether the baseline has fewer than 25 valid values: limits are then preliminary.
    pub preliminary: bool,
    /// σ from the mean moving range.
    pub sigma: SigmaEstimate,
    /// Limits of individual values, eq. (15).
    pub individuals: ControlLimits,
    /// Limits of moving ranges, eq. (16).
    pub moving_range: ControlLimits,
    /// Moving ranges of the baseline, one per value; gaps at the first value and beside gaps.
    pub moving_ranges: Vec<Option<f64>>,
}

/// Chart of means and standard deviations of subgroups (x̄-s).
#[derive(Debug, Clone, PartialEq)]
pub struct MeansChart {
    /// Number of values in a subgroup.
    pub size: usize,
    /// Number of complete subgroups of the baseline.
    pub n_subgroups: usize,
    /// Number of subgroups with gaps; they are gaps of the chart.
    pub n_incomplete: usize,
    /// Number of values after the last subgroup, not used.
    pub n_left_over: usize,
    /// Whether the baseline has fewer than 25 complete subgroups: limits are then preliminary.
    pub preliminary: bool,
    /// σ of the individual values from the mean standard deviation; that of the means is smaller by √size.
    pub sigma: SigmaEstimate,
    /// Limits of the means, eq. (21).
    pub means_limits: ControlLimits,
    /// Limits of the standard deviations, eq. (22).
    pub std_devs_limits: ControlLimits,
    /// Means of the subgroups.
    pub means: Vec<Option<f64>>,
    /// Standard deviations of the subgroups.
    pub std_devs: Vec<Option<f64>>,
}

/// Why a baseline gives no control limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ChartError {
    /// No standard deviation within subgroups.
    #[error("a subgroup needs at least 2 values, got {size}")]
    SubgroupSize {
        /// Number of values in a subgroup.
        size: usize,
    },
    /// Nothing to estimate σ from.
    #[error("the {n} valid values of the baseline contain no two consecutive ones or no complete subgroup")]
    TooFewValues {
        /// Number of valid values.
        n: usize,
    },
}

/// Limits of a chart of individual values and moving ranges from a baseline.
///
/// Method: `server/docs/maths/capability.md`, eq. (14)–(16), after the NIST/SEMATECH e-Handbook, 6.3.2.2. Assumes
/// independent normal values; the limits of moving ranges are those of a normal approximation.
///
/// # Errors
/// [`ChartError::TooFewValues`] if the baseline has no two consecutive valid values.
pub fn individuals_chart(baseline: &[Option<f64>]) -> Result<IndividualsChart, ChartError> {
    let values = valid_values(baseline);
    let n = values.len();
    let sigma = sigma_within(baseline, Grouping::Individuals).ok_or(ChartError::TooFewValues { n })?;
    let centre = mean(&values);
    let width = CONTROL_SIGMAS * sigma.sigma;
    let [mean_range, range_sigma] = [d2(2), d3(2)].map(|constant| constant.unwrap_or(0.0) * sigma.sigma);
    Ok(IndividualsChart {
        n,
        n_missing: baseline.len() - n,
        preliminary: n < MIN_PROCESS_VALUES,
        sigma,
        individuals: ControlLimits { lower: centre - width, centre, upper: centre + width },
        moving_range: ControlLimits {
            lower: (mean_range - CONTROL_SIGMAS * range_sigma).max(0.0),
            centre: mean_range,
            upper: mean_range + CONTROL_SIGMAS * range_sigma,
        },
        moving_ranges: moving_ranges(baseline),
    })
}

/// Limits of a chart of means and standard deviations from a baseline of consecutive subgroups of `size` values.
///
/// Method: `server/docs/maths/capability.md`, eq. (18)–(22), after the NIST/SEMATECH e-Handbook, 6.3.2.1.
///
/// # Errors
/// [`ChartError`] for subgroups of fewer than two values, and if no subgroup is complete.
pub fn means_chart(baseline: &[Option<f64>], size: usize) -> Result<MeansChart, ChartError> {
    let (a3, (b3, b4)) = a3(size).zip(b3_b4(size)).ok_or(ChartError::SubgroupSize { size })?;
    let points: Vec<Option<(f64, f64)>> = subgroups(baseline, size).collect();
    let (means, std_devs): (Vec<f64>, Vec<f64>) = points.iter().copied().flatten().unzip();
    let n = valid_values(baseline).len();
    let sigma = sigma_from_std_devs(&std_devs, size).ok_or(ChartError::TooFewValues { n })?;
    let (centre, mean_std_dev) = (mean(&means), mean(&std_devs));
    let width = a3 * mean_std_dev;
    Ok(MeansChart {
        size,
        n_subgroups: means.len(),
        n_incomplete: points.len() - means.len(),
        n_left_over: baseline.len() % size,
        preliminary: means.len() < MIN_PROCESS_VALUES,
        sigma,
        means_limits: ControlLimits { lower: centre - width, centre, upper: centre + width },
        std_devs_limits: ControlLimits {
            lower: b3 * mean_std_dev,
            centre: mean_std_dev,
            upper: b4 * mean_std_dev,
        },
        means: points.iter().map(|point| point.map(|(mean, _)| mean)).collect(),
        std_devs: points.iter().map(|point| point.map(|(_, std_dev)| std_dev)).collect(),
    })
}

/// Indices of the points outside control limits. For moving ranges and standard deviations, whose distributions are not
/// symmetric and to which the other run rules do not apply.
pub fn beyond_limits(points: &[Option<f64>], limits: &ControlLimits) -> Vec<usize> {
    let is_beyond = |point: f64| point < limits.lower || point > limits.upper;
    points
        .iter()
        .enumerate()
        .filter(|(_, point)| valid(**point).is_some_and(is_beyond))
        .map(|(idx, _)| idx)
        .collect()
}
