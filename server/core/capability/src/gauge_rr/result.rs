//! Result of a gauge R&R study, the same for both methods.

use super::study::Study;
use crate::params::{ACCEPTABLE_PERCENT, NDC_FACTOR, TOLERANCE_SIGMAS, UNACCEPTABLE_PERCENT};

/// Components of variation.
#[derive(Debug, Clone, PartialEq)]
pub struct GaugeRr {
    /// Method and its intermediate results.
    pub method: Method,
    /// Number of parts.
    pub n_parts: usize,
    /// Number of operators.
    pub n_operators: usize,
    /// Number of trials.
    pub n_trials: usize,
    /// EV, equipment variation: repeatability.
    pub repeatability: Component,
    /// AV, appraiser variation: differences between operators; `None` with one operator.
    pub reproducibility: Option<Component>,
    /// Interaction of parts and operators; `None` if it was pooled or is not estimated.
    pub interaction: Option<Component>,
    /// GRR: the three above, combined in quadrature.
    pub gauge_rr: Component,
    /// PV, part variation.
    pub part_variation: Component,
    /// TV, total variation: GRR and PV, combined in quadrature.
    pub total_variation: Component,
    /// Number of distinct categories, ⌊1.41 PV/GRR⌋; `None` if GRR is 0.
    pub ndc: Option<u64>,
}

/// One component of variation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component {
    /// Standard deviation, in the unit of the values.
    pub std_dev: f64,
    /// Standard deviation in per cent of the total variation. Percentages add in quadrature, not linearly.
    pub percent_of_total: f64,
    /// Six standard deviations in per cent of the tolerance; `None` without a tolerance.
    pub percent_of_tolerance: Option<f64>,
}

/// Method with its intermediate results.
#[derive(Debug, Clone, PartialEq)]
pub enum Method {
    /// Analysis of variance.
    Anova {
        /// Table of the model that was used.
        table: Vec<AnovaRow>,
        /// Test of the interaction; `None` with one operator.
        interaction_test: Option<InteractionTest>,
    },
    /// Averages and ranges, with the constants of eq. (8).
    AverageAndRange {
        /// 1/d2* of the trials.
        k1: f64,
        /// 1/d2* of the operators; `None` with one operator.
        k2: Option<f64>,
        /// 1/d2* of the parts.
        k3: f64,
    },
}

/// Source of variation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Differences between parts.
    Part,
    /// Differences between operators.
    Operator,
    /// Differences between operators that depend on the part.
    Interaction,
    /// Differences between trials.
    Repeatability,
}

/// Row of a table of analysis of variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnovaRow {
    /// Source of variation.
    pub source: Source,
    /// Degrees of freedom.
    pub dof: usize,
    /// Sum of squares, in the unit of the values squared.
    pub sum_of_squares: f64,
    /// Sum of squares divided by the degrees of freedom.
    pub mean_square: f64,
    /// Ratio to the mean square it is tested against; `None` for repeatability, or if that mean square is 0.
    pub f: Option<f64>,
    /// Probability of such an F without an effect of the source; `None` without F.
    pub p_value: Option<f64>,
}

/// Test of the interaction of parts and operators against repeatability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InteractionTest {
    /// Ratio of the mean squares; `None` if repeatability is 0.
    pub f: Option<f64>,
    /// Its p-value; `None` if repeatability is 0.
    pub p_value: Option<f64>,
    /// Whether the interaction was pooled with repeatability: p-value above 0.25.
    pub pooled: bool,
}

/// Why a study has no result.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GaugeRrError {
    /// The tolerance is not positive and finite.
    #[error("the tolerance must be positive and finite, got {tolerance}")]
    Tolerance {
        /// Tolerance.
        tolerance: f64,
    },
    /// Neither parts nor measurements vary.
    #[error("the measured values show no variation")]
    NoVariation,
    /// Outside the table of d2*.
    #[error("the average-and-range method supports up to {max} {quantity}, got {n}")]
    TooManyForRanges {
        /// `parts`, `operators` or `trials`.
        quantity: &'static str,
        /// Their number.
        n: usize,
        /// Largest supported number.
        max: usize,
    },
}

/// Standard deviations found by a method; `None` for what is not estimated.
pub(super) struct Deviations {
    pub repeatability: f64,
    pub reproducibility: Option<f64>,
    pub interaction: Option<f64>,
    pub part_variation: f64,
}

/// Combines standard deviations to a result.
pub(super) fn result_from_deviations(
    study: &Study,
    method: Method,
    deviations: &Deviations,
    tolerance: Option<f64>,
) -> Result<GaugeRr, GaugeRrError> {
    if let Some(tolerance) = tolerance.filter(|tolerance| !(tolerance.is_finite() && *tolerance > 0.0)) {
        return Err(GaugeRrError::Tolerance { tolerance });
    }
    let Deviations { repeatability, reproducibility, interaction, part_variation } = *deviations;
    let gauge_rr = repeatability.hypot(reproducibility.unwrap_or(0.0)).hypot(interaction.unwrap_or(0.0));
    let total_variation = gauge_rr.hypot(part_variation);
    if total_variation == 0.0 {
        return Err(GaugeRrError::NoVariation);
    }
    let component = |std_dev: f64| Component {
        std_dev,
        percent_of_total: 100.0 * std_dev / total_variation,
        percent_of_tolerance: tolerance.map(|tolerance| 100.0 * TOLERANCE_SIGMAS * std_dev / tolerance),
    };
    Ok(GaugeRr {
        method,
        n_parts: study.n_parts(),
        n_operators: study.n_operators(),
        n_trials: study.n_trials(),
        repeatability: component(repeatability),
        reproducibility: reproducibility.map(component),
        interaction: interaction.map(component),
        gauge_rr: component(gauge_rr),
        part_variation: component(part_variation),
        total_variation: component(total_variation),
        ndc: (gauge_rr > 0.0).then(|| (NDC_FACTOR * part_variation / gauge_rr).floor() as u64),
    })
}

/// Assessment of GRR in per cent of the total variation or of the tolerance (AIAG MSA 4, chapter III B).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acceptance {
    /// Up to 10 %.
    Acceptable,
    /// Up to 30 %: acceptable for some applications.
    Conditional,
    /// Above 30 %.
    Unacceptable,
}

/// Assessment of a percentage of GRR. AIAG also requires at least [`crate::params::MIN_NDC`] distinct categories.
pub fn acceptance(gauge_rr_percent: f64) -> Acceptance {
    if gauge_rr_percent <= ACCEPTABLE_PERCENT {
        Acceptance::Acceptable
    } else if gauge_rr_percent <= UNACCEPTABLE_PERCENT {
        Acceptance::Conditional
    } else {
        Acceptance::Unacceptable
    }
}
