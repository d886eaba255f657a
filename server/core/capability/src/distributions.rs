//! Distribution functions, from the special functions of `statrs`.

use std::f64::consts::SQRT_2;

use statrs::function::beta::beta_reg;
use statrs::function::erf::{erfc, erfc_inv};

/// Φ(z), the distribution function of the standard normal distribution; accurate in both tails.
pub(crate) fn normal_cdf(z: f64) -> f64 {
    0.5 * erfc(-z / SQRT_2)
}

/// Φ⁻¹(p) for 0 < p < 1.
pub(crate) fn normal_quantile(p: f64) -> f64 {
    -SQRT_2 * erfc_inv(2.0 * p)
}

/// Probability that |t| of Student's distribution with `dof` > 0 degrees of freedom is at least |`t`|.
pub(crate) fn student_two_sided(t: f64, dof: f64) -> f64 {
    beta_reg(dof / 2.0, 0.5, 1.0 / (1.0 + t * t / dof))
}

/// Probability that F with `dof_1`, `dof_2` > 0 degrees of freedom is at least `f` ≥ 0.
pub(crate) fn f_upper(f: f64, dof_1: f64, dof_2: f64) -> f64 {
    beta_reg(dof_2 / 2.0, dof_1 / 2.0, 1.0 / (1.0 + dof_1 * f / dof_2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of the printed values.
    const PRINTED: f64 = 1e-9;

    fn check(got: f64, expected: f64) {
        assert!((got - expected).abs() < PRINTED, "{got} is not {expected}");
    }

    #[test]
    fn the_normal_distribution_agrees_with_known_values_also_in_its_tails() {
        check(normal_cdf(0.0), 0.5);
        check(normal_cdf(1.0), 0.841_344_746_1);
        check(normal_quantile(0.975), 1.959_963_984_5);
        check(normal_quantile(normal_cdf(-3.0)), -3.0);
        assert!((normal_cdf(-10.0) / 7.619_853_024_160_5e-24 - 1.0).abs() < PRINTED);
    }

    /// Closed forms: ν = 1 is the Cauchy distribution, ν = 2 is P = 1 − t/√(2 + t²).
    #[test]
    fn students_distribution_agrees_with_its_closed_forms() {
        for t in [-3.0_f64, 0.0, 0.2, 1.0, 50.0] {
            check(student_two_sided(t, 1.0), 1.0 - 2.0 / std::f64::consts::PI * t.abs().atan());
            check(student_two_sided(t, 2.0), 1.0 - t.abs() / (2.0 + t * t).sqrt());
        }
    }

    /// Closed form for two numerator degrees of freedom: P = (1 + 2f/ν)^(−ν/2); and F(1, ν) = t².
    #[test]
    fn the_f_distribution_agrees_with_its_closed_forms() {
        for (f, dof) in [(0.0_f64, 7.0), (0.4, 3.0), (2.5, 60.0), (40.0, 11.0)] {
            check(f_upper(f, 2.0, dof), (1.0 + 2.0 * f / dof).powf(-dof / 2.0));
            check(f_upper(f, 1.0, dof), student_two_sided(f.sqrt(), dof));
        }
    }
}
