//! Statistics of a characteristic on the wire.

use app::statistics::{ControlChart, Series, SeriesReading};
use capability::Verdict;
use capability::gauge_rr::{Component, GaugeRr};
use capability::spc::{ControlLimits, Indices, ProcessCapability, Rule, Violation};
use capability::type_1::{Factors, Study};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// Selects the inspections of a statistic.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct SeriesQuery {
    /// Only by this version of the recipe.
    pub version: Option<i64>,
    /// Only of the part with this serial number.
    pub serial: Option<String>,
    /// Only for this order.
    pub order: Option<String>,
    /// Only inspections at or after this, ms since 1970 (UTC).
    pub from_ms: Option<i64>,
    /// Only inspections before this, ms since 1970 (UTC).
    pub to_ms: Option<i64>,
    /// At most so many, the newest; 1 to 5000, default 125.
    #[param(minimum = 1, maximum = 5000)]
    pub limit: Option<u32>,
    /// Type-1 study: value of the part from its certificate, in the unit of the characteristic.
    pub reference: Option<f64>,
    /// Type-1 study: standard deviations that count as scatter; default 6.
    #[param(inline)]
    pub n_sigmas: Option<SigmasDto>,
}

/// Standard deviations that count as the scatter of a measuring system.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
pub enum SigmasDto {
    /// 99.73 % of the values.
    #[serde(rename = "6")]
    Six,
    /// 95.45 % of the values.
    #[serde(rename = "4")]
    Four,
}

impl From<SigmasDto> for Factors {
    fn from(sigmas: SigmasDto) -> Self {
        match sigmas {
            SigmasDto::Six => Self::SIX_SIGMA,
            SigmasDto::Four => Self::FOUR_SIGMA,
        }
    }
}

/// Verdict on a process or a measuring system.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CapabilityVerdictDto {
    /// All requirements are met.
    Capable,
    /// At least one requirement is not met.
    NotCapable,
    /// Too few values, or no scatter between them.
    Undecided,
}

/// A value of a series.
#[derive(Debug, Serialize, ToSchema)]
pub struct ReadingDto {
    /// Number of the inspection.
    pub seq: i64,
    /// Its id.
    pub inspection_id: String,
    /// Serial number of the part.
    pub serial: String,
    /// The attribute `operator` of the inspection.
    pub operator: Option<String>,
    /// Time, ms since 1970 (UTC).
    pub at_ms: i64,
    /// The value; absent if it was not measured or is invalid.
    pub value: Option<f64>,
}

/// Limits of a control chart.
#[derive(Debug, Serialize, ToSchema)]
pub struct ControlLimitsDto {
    /// Lower control limit.
    pub lower: f64,
    /// Centre line.
    pub centre: f64,
    /// Upper control limit.
    pub upper: f64,
}

/// A violation of a run rule.
#[derive(Debug, Serialize, ToSchema)]
pub struct ViolationDto {
    /// Number of the rule (Nelson 1 to 8).
    pub rule: u8,
    /// First point of the pattern, as an index into `readings`.
    pub first_idx: usize,
    /// Last point of the pattern.
    pub last_idx: usize,
}

/// Capability indices from one estimate of σ.
#[derive(Debug, Serialize, ToSchema)]
pub struct IndicesDto {
    /// Cp or Pp; absent with a single limit.
    pub tolerance_index: Option<f64>,
    /// Cpk or Ppk.
    pub nearest_index: f64,
    /// 95 % confidence interval of `nearest_index`.
    pub interval: [f64; 2],
    /// Expected nonconforming parts per million, if values are normal.
    pub nonconforming_ppm: f64,
}

/// Capability of a process.
#[derive(Debug, Serialize, ToSchema)]
pub struct ProcessCapabilityDto {
    /// Mean.
    pub mean: f64,
    /// Overall standard deviation.
    pub sigma_overall: f64,
    /// Cp and Cpk, from σ within.
    pub potential: IndicesDto,
    /// Pp and Ppk, from the overall standard deviation.
    pub performance: IndicesDto,
    /// p-value of the Anderson-Darling test of normality; absent for fewer than eight values.
    pub normality_p_value: Option<f64>,
    /// Whether Cpk is at least 1.33, from at least 25 values.
    pub verdict: CapabilityVerdictDto,
}

/// A control chart of individual values and moving ranges.
#[derive(Debug, Serialize, ToSchema)]
pub struct ControlChartDto {
    /// Unit of all values.
    pub unit: String,
    /// Nominal value.
    pub nominal: Option<f64>,
    /// Lower specification limit.
    pub lower_limit: Option<f64>,
    /// Upper specification limit.
    pub upper_limit: Option<f64>,
    /// The values, oldest first.
    pub readings: Vec<ReadingDto>,
    /// Number of values that were not measured or are invalid.
    pub n_missing: usize,
    /// Whether there are fewer than 25 values: the control limits are preliminary.
    pub preliminary: bool,
    /// σ within, from the moving ranges.
    pub sigma_within: f64,
    /// Limits of the values.
    pub individuals: ControlLimitsDto,
    /// Limits of the moving ranges.
    pub moving_range: ControlLimitsDto,
    /// Violations of Nelson's rules.
    pub violations: Vec<ViolationDto>,
    /// Capability of the process; absent if it cannot be stated.
    pub capability: Option<ProcessCapabilityDto>,
    /// Why it cannot be stated.
    pub capability_reason: Option<String>,
}

/// A type-1 study: repeated measurements of one part with a known value.
#[derive(Debug, Serialize, ToSchema)]
pub struct Type1StudyDto {
    /// Unit of all values.
    pub unit: String,
    /// Number of values.
    pub n: usize,
    /// Number of values that were not measured or are invalid.
    pub n_missing: usize,
    /// Mean.
    pub mean: f64,
    /// Mean minus the value from the certificate.
    pub bias: f64,
    /// Standard deviation.
    pub std_dev: f64,
    /// Fraction of the tolerance that the scatter may fill.
    pub tolerance_fraction: f64,
    /// Standard deviations that count as scatter.
    pub n_sigmas: f64,
    /// Capability index of the scatter; absent without scatter.
    pub cg: Option<f64>,
    /// Capability index of scatter and bias; absent without scatter.
    pub cgk: Option<f64>,
    /// p-value of the bias (Student's t); absent without scatter.
    pub bias_p_value: Option<f64>,
    /// Capable if there are at least 50 values, and Cg and Cgk are at least 1.33.
    pub verdict: CapabilityVerdictDto,
}

/// A component of variation.
#[derive(Debug, Serialize, ToSchema)]
pub struct VariationDto {
    /// Standard deviation.
    pub std_dev: f64,
    /// Fraction of the total variation, per cent.
    pub percent_of_total: f64,
    /// Six standard deviations as a fraction of the tolerance, per cent; absent without two limits.
    pub percent_of_tolerance: Option<f64>,
}

/// A gauge R&R study by analysis of variance.
#[derive(Debug, Serialize, ToSchema)]
pub struct GaugeRrDto {
    /// Unit of all values.
    pub unit: String,
    /// Number of parts.
    pub n_parts: usize,
    /// Number of operators.
    pub n_operators: usize,
    /// Number of trials.
    pub n_trials: usize,
    /// Equipment variation.
    pub repeatability: VariationDto,
    /// Appraiser variation; absent with one operator.
    pub reproducibility: Option<VariationDto>,
    /// Interaction of parts and operators; absent with one operator.
    pub interaction: Option<VariationDto>,
    /// Repeatability and reproducibility together.
    pub gauge_rr: VariationDto,
    /// Variation of the parts.
    pub part_variation: VariationDto,
    /// Total variation.
    pub total_variation: VariationDto,
    /// Number of distinct categories; absent without measurement variation.
    pub ndc: Option<u64>,
}

impl From<Verdict> for CapabilityVerdictDto {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Capable => Self::Capable,
            Verdict::NotCapable => Self::NotCapable,
            Verdict::Undecided => Self::Undecided,
        }
    }
}

impl From<SeriesReading> for ReadingDto {
    fn from(reading: SeriesReading) -> Self {
        let SeriesReading { seq, inspection_id, serial, operator, at_ms, value } = reading;
        Self { seq, inspection_id, serial, operator, at_ms, value }
    }
}

impl From<ControlLimits> for ControlLimitsDto {
    fn from(limits: ControlLimits) -> Self {
        let ControlLimits { lower, centre, upper } = limits;
        Self { lower, centre, upper }
    }
}

impl From<Violation> for ViolationDto {
    fn from(violation: Violation) -> Self {
        // The one rule beyond Nelson's is not applied.
        let rule = Rule::NELSON.iter().position(|rule| *rule == violation.rule).map_or(0, |idx| idx as u8 + 1);
        Self { rule, first_idx: violation.first_idx, last_idx: violation.last_idx }
    }
}

impl From<Indices> for IndicesDto {
    fn from(indices: Indices) -> Self {
        Self {
            tolerance_index: indices.tolerance_index,
            nearest_index: indices.nearest_index,
            interval: [indices.interval.0, indices.interval.1],
            nonconforming_ppm: indices.nonconforming.total_ppm,
        }
    }
}

impl From<ProcessCapability> for ProcessCapabilityDto {
    fn from(capability: ProcessCapability) -> Self {
        Self {
            mean: capability.mean,
            sigma_overall: capability.sigma_overall,
            potential: capability.potential.into(),
            performance: capability.performance.into(),
            normality_p_value: capability.normality.map(|test| test.p_value),
            verdict: capability.verdict.into(),
        }
    }
}

impl ControlChartDto {
    /// The chart of a series.
    pub fn new(series: Series, result: ControlChart) -> Self {
        let ControlChart { chart, violations, capability } = result;
        let (capability, capability_reason) = match capability {
            Ok(capability) => (Some(capability.into()), None),
            Err(reason) => (None, Some(reason)),
        };
        Self {
            unit: series.unit,
            nominal: series.nominal,
            lower_limit: series.limits.lower,
            upper_limit: series.limits.upper,
            readings: series.readings.into_iter().map(ReadingDto::from).collect(),
            n_missing: chart.n_missing,
            preliminary: chart.preliminary,
            sigma_within: chart.sigma.sigma,
            individuals: chart.individuals.into(),
            moving_range: chart.moving_range.into(),
            violations: violations.into_iter().map(ViolationDto::from).collect(),
            capability,
            capability_reason,
        }
    }
}

impl Type1StudyDto {
    /// The study of a series.
    pub fn new(series: Series, study: &Study) -> Self {
        Self {
            unit: series.unit,
            n: study.n,
            n_missing: study.n_missing,
            mean: study.mean,
            bias: study.bias,
            std_dev: study.std_dev,
            tolerance_fraction: study.factors.tolerance_fraction,
            n_sigmas: study.factors.n_sigmas,
            cg: study.cg,
            cgk: study.cgk,
            bias_p_value: study.bias_test.map(|test| test.p_value),
            verdict: study.verdict.into(),
        }
    }
}

impl From<Component> for VariationDto {
    fn from(component: Component) -> Self {
        let Component { std_dev, percent_of_total, percent_of_tolerance } = component;
        Self { std_dev, percent_of_total, percent_of_tolerance }
    }
}

impl GaugeRrDto {
    /// The study of a series.
    pub fn new(series: Series, study: &GaugeRr) -> Self {
        Self {
            unit: series.unit,
            n_parts: study.n_parts,
            n_operators: study.n_operators,
            n_trials: study.n_trials,
            repeatability: study.repeatability.into(),
            reproducibility: study.reproducibility.map(VariationDto::from),
            interaction: study.interaction.map(VariationDto::from),
            gauge_rr: study.gauge_rr.into(),
            part_variation: study.part_variation.into(),
            total_variation: study.total_variation.into(),
            ndc: study.ndc,
        }
    }
}
