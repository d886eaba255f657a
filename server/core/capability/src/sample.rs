//! The valid values of a list with missing measurements.

/// A value, if it was measured and is finite.
pub(crate) fn valid(value: Option<f64>) -> Option<f64> {
    value.filter(|value| value.is_finite())
}

/// The valid values, in their order; all others are missing.
pub(crate) fn valid_values(values: &[Option<f64>]) -> Vec<f64> {
    values.iter().filter_map(|value| valid(*value)).collect()
}

/// Arithmetic mean; NaN if empty.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation of the sample (divisor n − 1); NaN for fewer than two values, exactly 0 for equal ones.
pub(crate) fn std_dev(values: &[f64]) -> f64 {
    if range(values) == 0.0 && values.len() > 1 {
        return 0.0;
    }
    let mean = mean(values);
    let sum: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (sum / (values.len() as f64 - 1.0)).sqrt()
}

/// Largest minus smallest value; −∞ if empty.
pub(crate) fn range(values: &[f64]) -> f64 {
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
    largest - smallest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finite_measurements_are_valid() {
        let values = [Some(1.0), None, Some(f64::NAN), Some(f64::INFINITY), Some(-2.0)];
        assert_eq!(valid_values(&values), [1.0, -2.0]);
    }

    #[test]
    fn mean_standard_deviation_and_range_of_eight_values() {
        let values = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        assert_eq!((mean(&values), range(&values)), (5.0, 7.0));
        assert!((std_dev(&values) - (32.0_f64 / 7.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn equal_values_have_no_standard_deviation_even_if_their_mean_is_rounded() {
        assert_eq!(std_dev(&[0.1; 50]), 0.0);
    }
}
