//! Gauge R&R by averages and ranges (AIAG MSA 4, chapter III B).

use super::result::{Deviations, GaugeRr, GaugeRrError, Method, result_from_deviations};
use super::study::Study;
use crate::control_constants::{MAX_VALUES_OF_A_RANGE, d2_star};
use crate::sample::range;

/// Evaluates a study by averages and ranges, for comparison with calculations by hand.
///
/// `tolerance`: upper minus lower limit of the characteristic, in the unit of the values; `None` if unknown.
///
/// Method: `server/docs/maths/capability.md`, eq. (8)–(12), after AIAG MSA 4. Does not estimate the interaction, which
/// then increases the other components; [`super::anova()`] does.
///
/// # Errors
/// [`GaugeRrError`] for a tolerance that is not positive, values without variation, and more than 20 parts, operators or
/// trials.
pub fn average_and_range(study: &Study, tolerance: Option<f64>) -> Result<GaugeRr, GaugeRrError> {
    let (n_parts, n_operators, n_trials) = (study.n_parts(), study.n_operators(), study.n_trials());
    let k1 = k("trials", n_trials, n_parts * n_operators)?;
    let k2 = (n_operators > 1).then(|| k("operators", n_operators, 1)).transpose()?;
    let k3 = k("parts", n_parts, 1)?;
    let repeatability = study.mean_range() * k1;
    let reproducibility = k2.map(|k2| {
        let of_means = (range(&study.operator_means()) * k2).powi(2);
        let of_repeatability = repeatability.powi(2) / (n_parts * n_trials) as f64;
        (of_means - of_repeatability).max(0.0).sqrt()
    });
    let part_variation = range(&study.part_means()) * k3;
    let deviations = Deviations { repeatability, reproducibility, interaction: None, part_variation };
    result_from_deviations(study, Method::AverageAndRange { k1, k2, k3 }, &deviations, tolerance)
}

/// 1/d2*, eq. (8).
fn k(quantity: &'static str, n: usize, n_ranges: usize) -> Result<f64, GaugeRrError> {
    let max = MAX_VALUES_OF_A_RANGE;
    d2_star(n, n_ranges).map(f64::recip).ok_or(GaugeRrError::TooManyForRanges { quantity, n, max })
}
