//! Type-1 studies with known scatter and bias. Not shown: that a real measuring system has normal, independent values.

use capability::Verdict;
use capability::type_1::{Factors, Request, Shortfall, Type1Error, evaluate};

/// Rounding of sums of some dozens of values.
const ROUNDING: f64 = 1e-9;

/// `n` values (an even number), half above and half below `mean`, with exactly the standard deviation `std_dev`.
fn values(n: usize, mean: f64, std_dev: f64) -> Vec<Option<f64>> {
    let distance = std_dev * ((n as f64 - 1.0) / n as f64).sqrt();
    (0..n).map(|idx| Some(if idx % 2 == 0 { mean + distance } else { mean - distance })).collect()
}

fn request(values: &[Option<f64>]) -> Request<'_> {
    Request { values, reference: 10.0, tolerance: 1.0, resolution: None, factors: Factors::SIX_SIGMA }
}

fn check(got: Option<f64>, expected: f64) {
    assert!(got.is_some_and(|got| (got - expected).abs() < ROUNDING), "{got:?} is not {expected}");
}

/// 0.2·1/(6·0.02) = 5/3; (0.1 − 0.01)/(3·0.02) = 3/2; and 0.2/(4·0.02) = 5/2, (0.1 − 0.01)/(2·0.02) = 9/4.
#[test]
fn cg_and_cgk_are_those_of_the_formula_in_both_variants() {
    let values = values(50, 10.01, 0.02);
    let study = evaluate(&request(&values)).unwrap();
    check(study.cg, 5.0 / 3.0);
    check(study.cgk, 1.5);
    assert_eq!((study.n, study.n_missing, study.verdict), (50, 0, Verdict::Capable));
    let study = evaluate(&Request { factors: Factors::FOUR_SIGMA, ..request(&values) }).unwrap();
    check(study.cg, 2.5);
    check(study.cgk, 2.25);
    assert_eq!(study.factors, Factors { tolerance_fraction: 0.2, n_sigmas: 4.0 });
}

#[test]
fn the_sign_of_the_bias_does_not_change_cgk() {
    let [above, below] = [9.97, 10.03].map(|mean| evaluate(&request(&values(50, mean, 0.02))).unwrap());
    check(above.cgk, below.cgk.unwrap());
    assert!((above.bias + 0.03).abs() < ROUNDING && (below.bias - 0.03).abs() < ROUNDING);
}

#[test]
fn a_bias_above_a_tenth_of_the_tolerance_makes_cgk_negative() {
    let study = evaluate(&request(&values(50, 10.11, 0.02))).unwrap();
    check(study.cgk, -0.01 / 0.06);
    assert_eq!((study.shortfalls, study.verdict), (vec![Shortfall::Cgk], Verdict::NotCapable));
}

/// t = 0.01/(0.02/√50) = 3.5355; printed quantiles of Student's t with 49 degrees of freedom: 2.0096 (5 %).
#[test]
fn the_bias_test_is_students_t_test() {
    let test = evaluate(&request(&values(50, 10.01, 0.02))).unwrap().bias_test.unwrap();
    assert!((test.t - 12.5_f64.sqrt()).abs() < 1e-6 && test.dof == 49 && test.significant);
    let at_quantile = 2.0096 * 0.02 / 50.0_f64.sqrt();
    let test = evaluate(&request(&values(50, 10.0 + at_quantile, 0.02))).unwrap().bias_test.unwrap();
    assert!((test.p_value - 0.05).abs() < 1e-4, "{}", test.p_value); // five printed digits of the quantile
    let test = evaluate(&request(&values(50, 10.0 + 0.99 * at_quantile, 0.02))).unwrap().bias_test.unwrap();
    assert!(!test.significant);
}

#[test]
fn capable_needs_fifty_values_and_both_indices_of_a_third_above_one() {
    let check = |n, mean, std_dev, shortfalls: &[Shortfall], verdict| {
        let study = evaluate(&request(&values(n, mean, std_dev))).unwrap();
        assert_eq!((study.shortfalls.as_slice(), study.verdict), (shortfalls, verdict), "{n} {mean} {std_dev}");
    };
    let at_limit = 0.2 / (6.0 * 1.33);
    check(50, 10.0, at_limit * 0.999, &[], Verdict::Capable);
    check(50, 10.0, at_limit * 1.001, &[Shortfall::Cg, Shortfall::Cgk], Verdict::NotCapable);
    check(50, 10.05, at_limit * 0.7, &[Shortfall::Cgk], Verdict::NotCapable);
    check(48, 10.0, at_limit * 0.5, &[Shortfall::TooFewValues], Verdict::Undecided);
    check(48, 10.05, at_limit * 0.7, &[Shortfall::TooFewValues, Shortfall::Cgk], Verdict::Undecided);
}

#[test]
fn missing_measurements_are_counted_and_do_not_count_as_values() {
    let mut values = values(50, 10.0, 0.02);
    values.extend([None, Some(f64::NAN), Some(f64::INFINITY)]);
    let study = evaluate(&request(&values)).unwrap();
    assert_eq!((study.n, study.n_missing, study.verdict), (50, 3, Verdict::Capable));
    values[7] = None;
    let study = evaluate(&request(&values)).unwrap();
    assert_eq!((study.n, study.n_missing, study.verdict), (49, 4, Verdict::Undecided));
}

#[test]
fn a_resolution_above_a_twentieth_of_the_tolerance_is_too_coarse() {
    let values = values(50, 10.0, 0.02);
    let study = |resolution| evaluate(&Request { resolution: Some(resolution), ..request(&values) }).unwrap();
    check(study(0.05).resolution_percent, 5.0);
    assert_eq!(study(0.05).verdict, Verdict::Capable);
    assert_eq!(
        (study(0.051).verdict, study(0.051).shortfalls),
        (Verdict::NotCapable, vec![Shortfall::Resolution])
    );
}

#[test]
fn equal_values_have_no_indices_and_no_verdict() {
    let study = evaluate(&request(&[Some(10.1); 60])).unwrap();
    assert_eq!((study.cg, study.cgk, study.bias_test), (None, None, None));
    assert_eq!((study.shortfalls, study.verdict), (vec![Shortfall::NoScatter], Verdict::Undecided));
}

#[test]
fn impossible_requests_are_refused_by_name() {
    let values = values(4, 10.0, 0.02);
    assert_eq!(evaluate(&request(&[Some(1.0), None])), Err(Type1Error::TooFewValues { n: 1 }));
    for (wrong, message) in [
        (Request { tolerance: 0.0, ..request(&values) }, "the tolerance must be positive and finite, got 0"),
        (
            Request { resolution: Some(-1.0), ..request(&values) },
            "the resolution must be positive and finite, got -1",
        ),
        (Request { reference: f64::NAN, ..request(&values) }, "the reference value must be finite, got NaN"),
    ] {
        assert_eq!(evaluate(&wrong).unwrap_err().to_string(), message);
    }
}
