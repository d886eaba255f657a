//! Constants that turn mean ranges and mean standard deviations of subgroups into σ and into control limits.
//!
//! All hold for independent values of one normal distribution.

use std::f64::consts::FRAC_2_SQRT_PI;

use statrs::function::gamma::ln_gamma;

use crate::params::{CONTROL_SIGMAS, MAX_SUBGROUPS_OF_D2_STAR};

/// Mean and standard deviation of the range of n = 2 … 20 values with σ = 1: d2 (Tippett 1925) and d3. Calculated by
/// numerical integration over the distribution of the range; AIAG MSA 4, appendix C, prints the same.
const RANGES: [(f64, f64); 19] = [
    (FRAC_2_SQRT_PI, 0.852_502),
    (1.692_568_75, 0.888_368),
    (2.058_750_75, 0.879_808),
    (2.325_928_95, 0.864_082),
    (2.534_412_72, 0.848_040),
    (2.704_356_75, 0.833_205),
    (2.847_200_61, 0.819_831),
    (2.970_026_32, 0.807_834),
    (3.077_505_46, 0.797_051),
    (3.172_872_70, 0.787_315),
    (3.258_455_28, 0.778_478),
    (3.335_980_35, 0.770_416),
    (3.406_763_11, 0.763_023),
    (3.471_826_89, 0.756_211),
    (3.531_982_79, 0.749_908),
    (3.587_883_96, 0.744_052),
    (3.640_063_76, 0.738_591),
    (3.688_963_02, 0.733_481),
    (3.734_950_12, 0.728_686),
];

/// Largest number of values for which d2 and d3 are tabulated.
pub const MAX_VALUES_OF_A_RANGE: usize = RANGES.len() + 1;

fn range_constants(n: usize) -> Option<(f64, f64)> {
    RANGES.get(n.checked_sub(2)?).copied()
}

/// d2: mean range of n values, in σ; `None` unless 2 ≤ n ≤ 20.
pub fn d2(n: usize) -> Option<f64> {
    range_constants(n).map(|(d2, _)| d2)
}

/// d3: standard deviation of the range of n values, in σ; `None` unless 2 ≤ n ≤ 20.
pub fn d3(n: usize) -> Option<f64> {
    range_constants(n).map(|(_, d3)| d3)
}

/// d2*: root mean square, in σ, of the mean of `n_ranges` ranges of n values each, eq. (9) (Duncan 1958).
///
/// Above 15 ranges it is d2, as in AIAG MSA 4, appendix C. `None` unless 2 ≤ n ≤ 20 and `n_ranges` ≥ 1.
pub fn d2_star(n: usize, n_ranges: usize) -> Option<f64> {
    let (d2, d3) = range_constants(n).filter(|_| n_ranges > 0)?;
    Some(if n_ranges > MAX_SUBGROUPS_OF_D2_STAR { d2 } else { (d2 * d2 + d3 * d3 / n_ranges as f64).sqrt() })
}

/// c4: mean standard deviation of n values, in σ, eq. (18); `None` for n < 2.
pub fn c4(n: usize) -> Option<f64> {
    let n = (n >= 2).then_some(n as f64)?;
    Some((2.0 / (n - 1.0)).sqrt() * (ln_gamma(n / 2.0) - ln_gamma((n - 1.0) / 2.0)).exp())
}

/// A3: distance of the limits of a chart of means from the centre line, in mean standard deviations; `None` for n < 2.
pub fn a3(n: usize) -> Option<f64> {
    Some(CONTROL_SIGMAS / (c4(n)? * (n as f64).sqrt()))
}

/// B3 and B4: limits of a chart of standard deviations, in mean standard deviations; `None` for n < 2.
pub fn b3_b4(n: usize) -> Option<(f64, f64)> {
    let c4 = c4(n)?;
    let width = CONTROL_SIGMAS * (1.0 - c4 * c4).sqrt() / c4;
    Some(((1.0 - width).max(0.0), 1.0 + width))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distributions::normal_cdf;

    /// d2(n) = ∫ 1 − Φⁿ − (1 − Φ)ⁿ dx (Tippett 1925), by the trapezoidal rule: exact to rounding for such integrands.
    #[test]
    fn d2_agrees_with_its_integral() {
        let step = 0.01;
        for n in 2..=MAX_VALUES_OF_A_RANGE {
            let power = |p: f64| p.powi(n as i32);
            let integrand = |x: f64| 1.0 - power(normal_cdf(x)) - power(normal_cdf(-x));
            let integral: f64 = (-900..=900).map(|idx| integrand(f64::from(idx) * step) * step).sum();
            assert!((integral - d2(n).unwrap()).abs() < 1e-8, "d2({n}) = {integral}");
        }
    }

    /// AIAG MSA 4, appendix C, first row (one range), which also holds d3; for two values it is √2 exactly.
    #[test]
    fn d2_star_of_one_range_is_the_printed_row_of_aiag() {
        let printed = [
            1.91155, 2.23887, 2.48124, 2.67253, 2.82981, 2.96288, 3.07794, 3.17905, 3.26909, 3.35016, 3.42378,
            3.49116, 3.55333, 3.61071, 3.66422, 3.71424, 3.76118, 3.80537,
        ];
        assert!((d2_star(2, 1).unwrap() - std::f64::consts::SQRT_2).abs() < 1e-6); // d3 has six digits
        let rounding = 2e-5; // The print differs from the integral by up to this, except once.
        for (n, printed) in (3..).zip(printed) {
            // 3.55333 for n = 15 is a misprint of 3.55323.
            let allowed = if n == 15 { 1.1e-4 } else { rounding };
            assert!((d2_star(n, 1).unwrap() - printed).abs() < allowed, "d2*({n}, 1)");
        }
    }

    #[test]
    fn d2_star_approaches_d2_with_the_number_of_ranges() {
        assert!((d2_star(3, 2).unwrap() - 1.80538).abs() < 1e-4); // AIAG MSA 4, appendix C
        assert!((d2_star(3, 15).unwrap() - 1.70804).abs() < 1e-4); // AIAG MSA 4, appendix C
        assert_eq!(d2_star(3, 16), d2(3));
    }

    /// Closed forms c4(2) = √(2/π), c4(3) = √π/2, and the factors printed by Montgomery, appendix VI.
    #[test]
    fn constants_of_standard_deviations_agree_with_closed_forms_and_the_printed_table() {
        assert!((c4(2).unwrap() - std::f64::consts::FRAC_2_PI.sqrt()).abs() < 1e-14);
        assert!((c4(3).unwrap() - std::f64::consts::PI.sqrt() / 2.0).abs() < 1e-14);
        let half_digit = 5e-4;
        for (n, printed) in [(2, [2.659, 0.0, 3.267]), (5, [1.427, 0.0, 2.089]), (10, [0.975, 0.284, 1.716])] {
            let (b3, b4) = b3_b4(n).unwrap();
            for (got, printed) in [a3(n).unwrap(), b3, b4].into_iter().zip(printed) {
                assert!((got - printed).abs() <= half_digit, "n = {n}: {got} is not {printed}");
            }
        }
    }

    #[test]
    fn there_are_no_constants_outside_the_table() {
        assert_eq!((d2(1), d2(21), d3(0), d2_star(3, 0)), (None, None, None, None));
        assert_eq!((c4(1), a3(0), b3_b4(1)), (None, None, None));
    }
}
