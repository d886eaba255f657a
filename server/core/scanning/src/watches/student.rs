//! Standard deviations estimated from few values.

/// The standard deviation of `value` with which it is as unlikely under a normal distribution as it is with `sigma`, which
/// has `n` degrees of freedom, under Student's (Wallace, Ann. Math. Statist. 30 (1959) 1121). At least `sigma`.
pub fn widened_sigma(value: f64, sigma: f64, n: f64) -> f64 {
    let t = value.abs() / sigma;
    let normal = (8.0 * n + 1.0) / (8.0 * n + 3.0) * (n * (t * t / n).ln_1p()).sqrt();
    if normal > 0.0 { value.abs() / normal } else { sigma }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_student_become_those_of_the_normal_distribution() {
        // Two-sided 0.1 %: Student's with 5, 10 and 30 degrees of freedom, and the normal 3.291.
        for (n, t) in [(5.0, 6.869), (10.0, 4.587), (30.0, 3.646)] {
            let sigmas = t / widened_sigma(t, 1.0, n);
            assert!((sigmas - 3.291).abs() < 0.03, "{n}: {sigmas}");
        }
        assert!((widened_sigma(0.0, 2.0, 5.0) - 2.0).abs() < 1e-12);
    }
}
