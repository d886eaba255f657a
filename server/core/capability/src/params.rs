//! Constants of the methods, each with its reason or source.

/// Least Cg, Cgk and Cpk of something capable: 4/3, one σ between the natural and the permitted limits on each side
/// (Bosch Booklets 9 and 10).
pub const MIN_CAPABILITY_INDEX: f64 = 1.33;

/// Fewest values of a type-1 study (Bosch Booklet 10): s is then known to 10 % (one σ).
pub const MIN_TYPE_1_VALUES: usize = 50;

/// Coarsest resolution, as a fraction of the tolerance (Bosch Booklet 10; VDA 5).
pub const MAX_RESOLUTION_FRACTION: f64 = 0.05;

/// Significance level of the test of the bias (AIAG MSA 4, chapter III B).
pub const BIAS_SIGNIFICANCE: f64 = 0.05;

/// The interaction of parts and operators is pooled with repeatability if its p-value is larger (AIAG MSA 4).
pub const POOLING_P_VALUE: f64 = 0.25;

/// Number of standard deviations compared with the tolerance: 99.73 % of a normal distribution (AIAG MSA 4; earlier
/// editions used 5.15).
pub const TOLERANCE_SIGMAS: f64 = 6.0;

/// Number of distinct categories per ratio of part variation to gauge R&R: √2, rounded as in AIAG MSA 4.
pub const NDC_FACTOR: f64 = 1.41;

/// Fewest distinct categories of an acceptable measuring system (AIAG MSA 4).
pub const MIN_NDC: u64 = 5;

/// Gauge R&R, in per cent, up to which a measuring system is acceptable (AIAG MSA 4).
pub const ACCEPTABLE_PERCENT: f64 = 10.0;

/// Gauge R&R, in per cent, above which a measuring system is unacceptable (AIAG MSA 4).
pub const UNACCEPTABLE_PERCENT: f64 = 30.0;

/// Number of subgroups above which the mean range is divided by d2 instead of d2* (AIAG MSA 4, appendix C).
pub const MAX_SUBGROUPS_OF_D2_STAR: usize = 15;

/// Distance of control limits from the centre line, in σ (Shewhart 1931): one false alarm in 370 points.
pub const CONTROL_SIGMAS: f64 = 3.0;

/// Fewest values of a verdict on a process, and of a baseline of control limits: with 25 values the 95 % interval of
/// Cpk = 1.33 extends from 0.93 to 1.73; fewer allow no useful statement.
pub const MIN_PROCESS_VALUES: usize = 25;

/// Confidence level of the intervals of Cpk and Ppk, two-sided.
pub const CONFIDENCE: f64 = 0.95;

/// Significance level of the test of normality.
pub const NORMALITY_SIGNIFICANCE: f64 = 0.05;

/// Fewest values for which the p-value of the Anderson–Darling test is known (D'Agostino & Stephens 1986, table 4.7).
pub const MIN_NORMALITY_VALUES: usize = 8;

/// Largest Anderson–Darling statistic for which the p-value is evaluated: the fitted parabola would rise again far beyond,
/// and here p < 10⁻²³ already.
pub const MAX_ANDERSON_DARLING: f64 = 10.0;

/// Parts per million.
pub const PPM: f64 = 1e6;
