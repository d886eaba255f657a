//! Capability indices of a process.

use super::normality::{Normality, anderson_darling};
use super::sigma::{Grouping, SigmaEstimate, sigma_within};
use super::specification::{Nonconforming, SpecificationLimits, expected_nonconforming};
use crate::Verdict;
use crate::distributions::normal_quantile;
use crate::params::{CONFIDENCE, MIN_CAPABILITY_INDEX, MIN_NORMALITY_VALUES, MIN_PROCESS_VALUES};
use crate::sample::{mean, std_dev, valid_values};

/// Input of a capability analysis.
#[derive(Debug, Clone, Copy)]
pub struct ProcessRequest<'a> {
    /// Measured values in the order of production.
    pub values: &'a [Option<f64>],
    /// Specification limits.
    pub limits: SpecificationLimits,
    /// How σ within is estimated.
    pub grouping: Grouping,
}

/// Result of a capability analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct ProcessCapability {
    /// Number of valid values.
    pub n: usize,
    /// Number of gaps.
    pub n_missing: usize,
    /// Mean of all valid values.
    pub mean: f64,
    /// σ within, from moving ranges or subgroups.
    pub sigma_within: SigmaEstimate,
    /// Overall standard deviation of all valid values (divisor n − 1).
    pub sigma_overall: f64,
    /// Cp and Cpk, from σ within.
    pub potential: Indices,
    /// Pp and Ppk, from the overall standard deviation.
    pub performance: Indices,
    /// Test of normality; `None` for fewer than eight values.
    pub normality: Option<Normality>,
    /// Restrictions of the result.
    pub notes: Vec<Note>,
    /// Whether Cpk is at least 1.33; undecided for fewer than 25 values. It refers to the estimate, not to the lower end
    /// of its interval, and assumes a stable process and normal values: see the notes and the run rules.
    pub verdict: Verdict,
}

/// Capability indices from one estimate of σ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Indices {
    /// Cp or Pp: tolerance over 6 σ, eq. (23); `None` with a single limit.
    pub tolerance_index: Option<f64>,
    /// Cpk or Ppk: distance of the mean from the nearer limit over 3 σ, eq. (24). Negative if the mean is outside.
    pub nearest_index: f64,
    /// Two-sided 95 % confidence interval of `nearest_index`, lower and upper end, eq. (26).
    pub interval: (f64, f64),
    /// Expected nonconforming parts, eq. (27).
    pub nonconforming: Nonconforming,
}

/// Restriction of a result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Note {
    /// Too few values for a verdict.
    TooFewValues {
        /// Number of valid values.
        n: usize,
        /// Number needed.
        needed: usize,
    },
    /// Values are not normal: indices do not correspond to nonconforming parts, and the parts per million are wrong.
    NotNormal {
        /// p-value of the test.
        p_value: f64,
    },
    /// Too few values for the test of normality.
    NormalityNotTested {
        /// Number of valid values.
        n: usize,
        /// Number needed.
        needed: usize,
    },
}

/// Why a capability analysis is impossible.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ProcessError {
    /// Neither limit.
    #[error("at least one specification limit is needed")]
    NoLimits,
    /// A limit that is not finite.
    #[error("specification limits must be finite, got {limit}")]
    LimitNotFinite {
        /// Limit.
        limit: f64,
    },
    /// The lower limit is not below the upper one.
    #[error("the lower limit {lower} is not below the upper limit {upper}")]
    LimitsReversed {
        /// Lower limit.
        lower: f64,
        /// Upper limit.
        upper: f64,
    },
    /// Nothing to estimate σ from.
    #[error("the {n} valid values contain no two consecutive ones or no complete subgroup of two or more")]
    TooFewValues {
        /// Number of valid values.
        n: usize,
    },
    /// σ within is 0: consecutive values or all values of every subgroup are equal.
    #[error("the measured values show no scatter")]
    NoScatter,
}

/// Capability indices of a process.
///
/// Method: `server/docs/maths/capability.md`, eq. (23)–(30), after the NIST/SEMATECH e-Handbook, 6.1.6, and Bissell (1990).
/// The measurement uncertainty is part of the scatter.
///
/// # Errors
/// [`ProcessError`] for unusable limits, and for values without an estimate of σ.
pub fn process_capability(request: &ProcessRequest) -> Result<ProcessCapability, ProcessError> {
    check(request.limits)?;
    let values = valid_values(request.values);
    let n = values.len();
    let is_grouped = !matches!(request.grouping, Grouping::Subgroups { size: 0 | 1 });
    let within = is_grouped.then(|| sigma_within(request.values, request.grouping)).flatten();
    let sigma_within = within.ok_or(ProcessError::TooFewValues { n })?;
    if sigma_within.sigma == 0.0 {
        return Err(ProcessError::NoScatter);
    }
    let (mean, sigma_overall) = (mean(&values), std_dev(&values));
    let overall = SigmaEstimate { sigma: sigma_overall, dof: n as f64 - 1.0, n_used: n };
    let potential = indices(mean, sigma_within, n, request.limits);
    let normality = anderson_darling(request.values);
    Ok(ProcessCapability {
        n,
        n_missing: request.values.len() - n,
        mean,
        sigma_within,
        sigma_overall,
        potential,
        performance: indices(mean, overall, n, request.limits),
        normality,
        notes: notes(n, normality),
        verdict: if n < MIN_PROCESS_VALUES {
            Verdict::Undecided
        } else if potential.nearest_index >= MIN_CAPABILITY_INDEX {
            Verdict::Capable
        } else {
            Verdict::NotCapable
        },
    })
}

fn check(limits: SpecificationLimits) -> Result<(), ProcessError> {
    let given = [limits.lower, limits.upper];
    if let Some(limit) = given.into_iter().flatten().find(|limit| !limit.is_finite()) {
        return Err(ProcessError::LimitNotFinite { limit });
    }
    match (limits.lower, limits.upper) {
        (None, None) => Err(ProcessError::NoLimits),
        (Some(lower), Some(upper)) if lower >= upper => Err(ProcessError::LimitsReversed { lower, upper }),
        _ => Ok(()),
    }
}

fn indices(mean: f64, estimate: SigmaEstimate, n: usize, limits: SpecificationLimits) -> Indices {
    let SigmaEstimate { sigma, dof, .. } = estimate;
    let margins = [limits.lower.map(|lower| mean - lower), limits.upper.map(|upper| upper - mean)];
    let nearest_index = margins.into_iter().flatten().fold(f64::INFINITY, f64::min) / (3.0 * sigma);
    let variance = 1.0 / (9.0 * n as f64) + nearest_index * nearest_index / (2.0 * dof);
    let half_width = normal_quantile(0.5 + CONFIDENCE / 2.0) * variance.sqrt();
    Indices {
        tolerance_index: limits.lower.zip(limits.upper).map(|(lower, upper)| (upper - lower) / (6.0 * sigma)),
        nearest_index,
        interval: (nearest_index - half_width, nearest_index + half_width),
        nonconforming: expected_nonconforming(mean, sigma, limits),
    }
}

fn notes(n: usize, normality: Option<Normality>) -> Vec<Note> {
    let few = (n < MIN_PROCESS_VALUES).then_some(Note::TooFewValues { n, needed: MIN_PROCESS_VALUES });
    let normality = match normality {
        None => Some(Note::NormalityNotTested { n, needed: MIN_NORMALITY_VALUES }),
        Some(test) => test.rejected.then_some(Note::NotNormal { p_value: test.p_value }),
    };
    few.into_iter().chain(normality).collect()
}
