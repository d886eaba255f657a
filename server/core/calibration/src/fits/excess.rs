//! Scatter in excess of known noise.

/// Bisections of the interval of the variance: to a millionth of a millionth of it.
const HALVINGS: usize = 40;

/// The σ whose square, added to the noise of the data, makes their `misfit(σ²)` the expected one; `misfit` decreases
/// with its argument.
///
/// `hidden` is a variance that the noise could hide, `highest` one above the answer, in the unit of σ². If noise alone
/// explains the data, the σ that it could hide, above zero.
pub(super) fn excess_sigma(hidden: f64, highest: f64, expected: f64, misfit: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (hidden, highest);
    if !(high > low && misfit(low) > expected) {
        return hidden.max(f64::MIN_POSITIVE).sqrt();
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if misfit(middle) > expected { low = middle } else { high = middle }
    }
    high.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_excess_of_equal_noise_is_what_is_left_of_the_variance() {
        let errors = [3.0, -3.0, 3.0, -3.0_f64];
        let misfit = |variance: f64| errors.iter().map(|e| e * e / (variance + 4.0)).sum::<f64>();
        // 4 · 9 / (σ² + 4) = 4.
        assert!((excess_sigma(0.01, 36.0, 4.0, misfit) - 5f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn noise_that_explains_the_data_leaves_what_it_could_hide() {
        let misfit = |variance: f64| 1.0 / (variance + 4.0);
        assert!((excess_sigma(0.25, 36.0, 4.0, misfit) - 0.5).abs() < 1e-12);
    }
}
