//! Anderson–Darling test of normality with estimated mean and standard deviation.

use crate::distributions::normal_cdf;
use crate::params::{MAX_ANDERSON_DARLING, MIN_NORMALITY_VALUES, NORMALITY_SIGNIFICANCE};
use crate::sample::{mean, std_dev, valid_values};

/// Result of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normality {
    /// A², eq. (28).
    pub a_squared: f64,
    /// A² adjusted for the number of values, eq. (29).
    pub a_squared_adjusted: f64,
    /// Probability of a larger statistic if the values are normal, eq. (30). An approximation, reliable to about two
    /// digits for p > 0.001.
    pub p_value: f64,
    /// Whether the p-value is below 5 %.
    pub rejected: bool,
}

/// Tests whether the valid values are from a normal distribution; `None` for fewer than eight or equal values.
///
/// Method: `server/docs/maths/capability.md`, eq. (28)–(30), after D'Agostino & Stephens (1986), table 4.9. Rounded
/// normal values are rejected too often: with a resolution of a fifth of the standard deviation, 17 % of samples of 125.
pub fn anderson_darling(values: &[Option<f64>]) -> Option<Normality> {
    let mut values = valid_values(values);
    values.sort_unstable_by(f64::total_cmp);
    let (mean, std_dev) = (mean(&values), std_dev(&values));
    if values.len() < MIN_NORMALITY_VALUES || std_dev == 0.0 {
        return None;
    }
    let n = values.len() as f64;
    // The smallest positive number stands for probabilities that underflow (beyond 37 σ).
    let ln_cdf = |value: f64| normal_cdf(value).max(f64::MIN_POSITIVE).ln();
    let term = |(idx, (small, large)): (usize, (&f64, &f64))| {
        (2.0 * idx as f64 + 1.0) * (ln_cdf((small - mean) / std_dev) + ln_cdf((mean - large) / std_dev))
    };
    let sum: f64 = values.iter().zip(values.iter().rev()).enumerate().map(term).sum();
    let a_squared = -n - sum / n;
    let a_squared_adjusted = a_squared * (1.0 + 0.75 / n + 2.25 / (n * n));
    let p_value = p_value(a_squared_adjusted);
    Some(Normality { a_squared, a_squared_adjusted, p_value, rejected: p_value < NORMALITY_SIGNIFICANCE })
}

/// Eq. (30): four fitted parabolas (D'Agostino & Stephens 1986, table 4.9).
fn p_value(statistic: f64) -> f64 {
    let a = statistic.min(MAX_ANDERSON_DARLING);
    let fitted = |constant: f64, linear: f64, quadratic: f64| (constant + (linear + quadratic * a) * a).exp();
    if a < 0.2 {
        1.0 - fitted(-13.436, 101.14, -223.73)
    } else if a < 0.34 {
        1.0 - fitted(-8.318, 42.796, -59.938)
    } else if a < 0.6 {
        fitted(0.9177, -4.279, -1.38)
    } else {
        fitted(1.2937, -5.709, 0.0186)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Significance points of the adjusted statistic (D'Agostino & Stephens 1986, table 4.7, case 3).
    #[test]
    fn p_values_agree_with_the_table_of_significance_points() {
        for (statistic, significance) in
            [(0.470, 0.25), (0.561, 0.15), (0.631, 0.10), (0.752, 0.05), (0.873, 0.025)]
        {
            let got = p_value(statistic);
            assert!((got / significance - 1.0).abs() < 0.03, "{statistic}: {got} is not {significance}"); // two digits
        }
    }

    #[test]
    fn the_p_value_falls_with_the_statistic() {
        let p_values: Vec<f64> = (1..2000).map(|idx| p_value(f64::from(idx) * 0.01)).collect();
        // The parabolas meet to better than 0.002.
        assert!(p_values.windows(2).all(|pair| pair[1] <= pair[0] + 0.002));
        assert!(p_values.iter().all(|p| (0.0..=1.0).contains(p)));
        assert!(p_values[0] > 0.99 && p_values[1998] < 1e-20);
    }
}
