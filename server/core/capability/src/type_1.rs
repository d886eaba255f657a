//! Type-1 study: repeated measurements of one reference part.

use crate::Verdict;
use crate::distributions::student_two_sided;
use crate::params::{BIAS_SIGNIFICANCE, MAX_RESOLUTION_FRACTION, MIN_CAPABILITY_INDEX, MIN_TYPE_1_VALUES};
use crate::sample::{mean, std_dev, valid_values};

/// Fraction of the tolerance that the scatter of the measuring system may fill, and the number of standard deviations
/// that count as its scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// Fraction of the tolerance, for example 0.2.
    pub tolerance_fraction: f64,
    /// Width of the scatter in standard deviations, for example 6.
    pub n_sigmas: f64,
}

impl Factors {
    /// 20 % of the tolerance against 6 s: 99.73 % of the values (Bosch Booklet 10).
    pub const SIX_SIGMA: Self = Self { tolerance_fraction: 0.2, n_sigmas: 6.0 };
    /// 20 % of the tolerance against 4 s: 95.45 % of the values (VDA 5).
    pub const FOUR_SIGMA: Self = Self { tolerance_fraction: 0.2, n_sigmas: 4.0 };
}

/// Input of a type-1 study.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// Measured values of the reference part, in the order of measurement.
    pub values: &'a [Option<f64>],
    /// Reference value of the part, from its certificate.
    pub reference: f64,
    /// Tolerance T of the characteristic: upper minus lower limit.
    pub tolerance: f64,
    /// Resolution of the measuring system: smallest step of its values; `None` if unknown.
    pub resolution: Option<f64>,
    /// Variant of Cg and Cgk.
    pub factors: Factors,
}

/// Result of a type-1 study.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// Number of valid values.
    pub n: usize,
    /// Number of missing measurements.
    pub n_missing: usize,
    /// Mean of the values.
    pub mean: f64,
    /// Mean minus reference value.
    pub bias: f64,
    /// Standard deviation s of the values (divisor n − 1).
    pub std_dev: f64,
    /// Variant used for `cg` and `cgk`.
    pub factors: Factors,
    /// Capability index of the scatter, eq. (1); `None` if s is 0.
    pub cg: Option<f64>,
    /// Capability index of scatter and bias, eq. (2); `None` if s is 0. Negative if the bias alone is too large.
    pub cgk: Option<f64>,
    /// Test of the bias against 0; `None` if s is 0.
    pub bias_test: Option<BiasTest>,
    /// Resolution in per cent of the tolerance; `None` if it is unknown.
    pub resolution_percent: Option<f64>,
    /// Requirements that are not met, in the order of [`Shortfall`].
    pub shortfalls: Vec<Shortfall>,
    /// Capable if there is no shortfall; undecided if there are too few values or they have no scatter, unless the
    /// resolution is too coarse, which no number of values can change.
    pub verdict: Verdict,
}

/// Student's t-test of the bias, eq. (3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasTest {
    /// Bias divided by its standard error s/√n.
    pub t: f64,
    /// Degrees of freedom, n − 1.
    pub dof: usize,
    /// Two-sided p-value: probability of such a |t| without bias.
    pub p_value: f64,
    /// Whether the p-value is below 5 %. Significance is not a verdict: Cgk judges the size of the bias.
    pub significant: bool,
}

/// Requirement of a type-1 study that is not met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shortfall {
    /// Fewer than 50 valid values.
    TooFewValues,
    /// All values are equal: Cg and Cgk are undefined. The resolution is too coarse, or the value was not updated.
    NoScatter,
    /// The resolution is coarser than 5 % of the tolerance.
    Resolution,
    /// Cg is below 1.33.
    Cg,
    /// Cgk is below 1.33.
    Cgk,
}

/// Why a type-1 study is impossible.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Type1Error {
    /// No standard deviation.
    #[error("a type-1 study needs at least 2 valid values, got {n}")]
    TooFewValues {
        /// Number of valid values.
        n: usize,
    },
    /// The reference value is not a number.
    #[error("the reference value must be finite, got {reference}")]
    Reference {
        /// Reference value.
        reference: f64,
    },
    /// Tolerance, resolution or a factor is not positive and finite.
    #[error("the {quantity} must be positive and finite, got {value}")]
    NotPositive {
        /// Name of the quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Evaluates a type-1 study.
///
/// Method: `server/docs/maths/capability.md`, eq. (1)–(3), after Bosch Booklet 10. The uncertainty of the reference
/// value is not included.
///
/// # Errors
/// [`Type1Error`] for fewer than two valid values, or a quantity that is not positive and finite.
pub fn evaluate(request: &Request) -> Result<Study, Type1Error> {
    check(request)?;
    let values = valid_values(request.values);
    let n = values.len();
    if n < 2 {
        return Err(Type1Error::TooFewValues { n });
    }
    let (mean, std_dev) = (mean(&values), std_dev(&values));
    let bias = mean - request.reference;
    let Factors { tolerance_fraction, n_sigmas } = request.factors;
    let permitted = tolerance_fraction * request.tolerance;
    let scatters = std_dev > 0.0;
    let mut study = Study {
        n,
        n_missing: request.values.len() - n,
        mean,
        bias,
        std_dev,
        factors: request.factors,
        cg: scatters.then(|| permitted / (n_sigmas * std_dev)),
        cgk: scatters.then(|| (permitted / 2.0 - bias.abs()) / (n_sigmas / 2.0 * std_dev)),
        bias_test: scatters.then(|| bias_test(bias, std_dev, n)),
        resolution_percent: request.resolution.map(|resolution| 100.0 * resolution / request.tolerance),
        shortfalls: Vec::new(),
        verdict: Verdict::Undecided,
    };
    study.shortfalls = shortfalls(&study);
    study.verdict = verdict(&study.shortfalls);
    Ok(study)
}

fn check(request: &Request) -> Result<(), Type1Error> {
    let Factors { tolerance_fraction, n_sigmas } = request.factors;
    if !request.reference.is_finite() {
        return Err(Type1Error::Reference { reference: request.reference });
    }
    let positive = [
        ("tolerance", Some(request.tolerance)),
        ("resolution", request.resolution),
        ("fraction of the tolerance", Some(tolerance_fraction)),
        ("number of standard deviations", Some(n_sigmas)),
    ];
    let wrong = positive.into_iter().find_map(|(quantity, value)| {
        value.filter(|value| !(value.is_finite() && *value > 0.0)).map(|value| (quantity, value))
    });
    wrong.map_or(Ok(()), |(quantity, value)| Err(Type1Error::NotPositive { quantity, value }))
}

fn bias_test(bias: f64, std_dev: f64, n: usize) -> BiasTest {
    let t = bias / (std_dev / (n as f64).sqrt());
    let p_value = student_two_sided(t, n as f64 - 1.0);
    BiasTest { t, dof: n - 1, p_value, significant: p_value < BIAS_SIGNIFICANCE }
}

fn shortfalls(study: &Study) -> Vec<Shortfall> {
    let is_low = |index: Option<f64>| index.is_some_and(|index| index < MIN_CAPABILITY_INDEX);
    let is_coarse = study.resolution_percent.is_some_and(|percent| percent > 100.0 * MAX_RESOLUTION_FRACTION);
    [
        (study.n < MIN_TYPE_1_VALUES, Shortfall::TooFewValues),
        (study.cg.is_none(), Shortfall::NoScatter),
        (is_coarse, Shortfall::Resolution),
        (is_low(study.cg), Shortfall::Cg),
        (is_low(study.cgk), Shortfall::Cgk),
    ]
    .into_iter()
    .filter_map(|(applies, shortfall)| applies.then_some(shortfall))
    .collect()
}

fn verdict(shortfalls: &[Shortfall]) -> Verdict {
    let has = |shortfall| shortfalls.contains(&shortfall);
    if shortfalls.is_empty() {
        Verdict::Capable
    } else if !has(Shortfall::Resolution) && (has(Shortfall::TooFewValues) || has(Shortfall::NoScatter)) {
        Verdict::Undecided
    } else {
        Verdict::NotCapable
    }
}
