//! Anderson–Darling test: a value calculated by hand, and its rate of rejections.

use capability::spc::anderson_darling;

use crate::examples::{measured, normal_values};

/// Rejections of `samples` at 5 %, as a share.
fn share_rejected(samples: impl Iterator<Item = Vec<f64>>) -> f64 {
    let rejected: Vec<f64> =
        samples.map(|sample| f64::from(anderson_darling(&measured(&sample)).unwrap().rejected)).collect();
    rejected.iter().sum::<f64>() / rejected.len() as f64
}

#[test]
fn normal_values_are_rejected_as_often_as_the_significance_level_says() {
    let n_samples = 8000;
    for (n, seed) in [(10, 31), (50, 32)] {
        let values = normal_values(seed, n * n_samples);
        let share = share_rejected(values.chunks(n).map(<[f64]>::to_vec));
        let four_sigma = 4.0 * (0.05 * 0.95 / n_samples as f64).sqrt();
        assert!((share - 0.05).abs() < four_sigma, "n = {n}: {share}");
    }
}

/// A known weakness: rounding to a fifth of σ rejects 17 % of samples of 125 (an independent simulation, ± 1 %).
#[test]
fn rounded_normal_values_are_rejected_too_often() {
    let values = normal_values(37, 125 * 2000);
    let round = |value: &f64| ((value + 0.2) * 5.0).round() / 5.0;
    let share = share_rejected(values.chunks(125).map(|sample| sample.iter().map(round).collect()));
    assert!((share - 0.17).abs() < 0.05, "{share}"); // 4 σ of both simulations
}

#[test]
fn lognormal_values_are_recognised() {
    let values = normal_values(33, 50 * 400);
    let share = share_rejected(values.chunks(50).map(|sample| sample.iter().map(|value| value.exp()).collect()));
    assert!(share > 0.99, "{share}"); // Stephens 1974: the power is above 0.99 for n = 50
}

/// Eight values; A² by the definition in exact arithmetic of 30 digits, independent of this code.
#[test]
fn the_statistic_is_that_of_the_definition() {
    let values = [1.0, 2.0, 2.5, 3.0, 3.2, 4.0, 5.0, 9.0];
    let test = anderson_darling(&measured(&values)).unwrap();
    assert!((test.a_squared - A_SQUARED).abs() < 1e-9, "{}", test.a_squared);
    assert!((test.a_squared_adjusted - A_SQUARED * (1.0 + 0.75 / 8.0 + 2.25 / 64.0)).abs() < 1e-9);
}

const A_SQUARED: f64 = 0.489484767597;

#[test]
fn shift_and_scale_do_not_change_the_test() {
    let values = normal_values(34, 40);
    let moved: Vec<f64> = values.iter().map(|value| 100.0 - 3.0 * value).collect();
    let [plain, moved] = [values, moved].map(|values| anderson_darling(&measured(&values)).unwrap());
    assert!((plain.a_squared - moved.a_squared).abs() < 1e-9);
}

#[test]
fn a_wild_value_is_rejected_and_finite() {
    let mut values = normal_values(35, 2000);
    values.push(1e6);
    let test = anderson_darling(&measured(&values)).unwrap();
    assert!(test.a_squared.is_finite() && test.p_value < 1e-20 && test.rejected);
}

#[test]
fn few_or_equal_values_are_not_tested() {
    let mut values = measured(&normal_values(36, 8));
    assert!(anderson_darling(&values).is_some());
    values[3] = None;
    assert_eq!(anderson_darling(&values), None);
    assert_eq!(anderson_darling(&[Some(0.1); 30]), None);
}
