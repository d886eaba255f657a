//! Capability indices of published examples and of simulated processes.

use capability::Verdict;
use capability::spc::{
    Grouping, Note, ProcessCapability, ProcessError, ProcessRequest, SpecificationLimits, process_capability,
};

use crate::examples::{PISTON_RINGS, measured, normal_values};

const ROUNDING: f64 = 1e-9;

fn limits(lower: f64, upper: f64) -> SpecificationLimits {
    SpecificationLimits { lower: Some(lower), upper: Some(upper) }
}

fn evaluate(values: &[Option<f64>], limits: SpecificationLimits) -> ProcessCapability {
    process_capability(&ProcessRequest { values, limits, grouping: Grouping::Individuals }).unwrap()
}

fn assert_near(got: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((got - expected).abs() <= tolerance, "{what}: {got} is not {expected}");
}

/// `n` values (an even number), the first half above and the second below `mean`, with exactly the overall standard
/// deviation `std_dev`.
fn values(n: usize, mean: f64, std_dev: f64) -> Vec<Option<f64>> {
    let distance = std_dev * ((n as f64 - 1.0) / n as f64).sqrt();
    (0..n).map(|idx| Some(if idx < n / 2 { mean + distance } else { mean - distance })).collect()
}

/// NIST/SEMATECH e-Handbook, 6.1.6: limits 8 and 20, mean 16, s = 2: Cp = 1.0, Cpk = 0.6667. Its interval for n = 50:
/// 0.6667 ± 1.96·√(1/450 + 0.6667²/98).
#[test]
fn indices_of_the_handbook_example_are_the_printed_ones() {
    let process = evaluate(&values(50, 16.0, 2.0), limits(8.0, 20.0));
    assert_near(process.performance.tolerance_index.unwrap(), 1.0, ROUNDING, "Pp");
    assert_near(process.performance.nearest_index, 2.0 / 3.0, ROUNDING, "Ppk");
    let half_width = 1.959_964 * (1.0_f64 / 450.0 + 4.0 / 9.0 / 98.0).sqrt();
    assert_near(process.performance.interval.0, 2.0 / 3.0 - half_width, 1e-6, "lower end");
    assert_near(process.performance.interval.1, 2.0 / 3.0 + half_width, 1e-6, "upper end");
    // 1 − Φ(2) = 22 750.13 and Φ(−4) = 31.67 parts per million.
    let nonconforming = process.performance.nonconforming;
    assert_near(nonconforming.above_ppm.unwrap(), 22_750.13, 0.01, "above");
    assert_near(nonconforming.below_ppm.unwrap(), 31.67, 0.01, "below");
    assert_near(nonconforming.total_ppm, 22_781.80, 0.02, "total");
}

/// One step: a single moving range is not 0.
#[test]
fn cp_uses_the_scatter_within_and_pp_the_overall_one() {
    let process = evaluate(&values(100, 16.0, 2.0), limits(8.0, 20.0));
    let distance = 2.0 * 0.99_f64.sqrt();
    let mean_range = 2.0 * distance / 99.0;
    let sigma = mean_range * std::f64::consts::PI.sqrt() / 2.0;
    assert_near(process.sigma_within.sigma, sigma, ROUNDING, "σ within");
    assert_near(process.potential.tolerance_index.unwrap(), 2.0 / sigma, ROUNDING, "Cp");
    assert_near(process.potential.nearest_index, 4.0 / (3.0 * sigma), ROUNDING, "Cpk");
    assert_near(process.sigma_overall, 2.0, ROUNDING, "σ overall");
}

/// Subgroups: σ = s̄/c4 = 0.009829977 (R package qcc); limits 74.000 ± 0.05, mean 74.001176: Cp = 1.695, Cpk = 1.656.
#[test]
fn indices_of_the_piston_rings_follow_from_the_published_sigma() {
    let rings = measured(PISTON_RINGS.as_flattened());
    let grouping = Grouping::Subgroups { size: 5 };
    let process = process_capability(&ProcessRequest { values: &rings, limits: limits(73.95, 74.05), grouping });
    let process = process.unwrap();
    let sigma = 0.009_829_977;
    assert_near(process.potential.tolerance_index.unwrap(), 0.1 / (6.0 * sigma), 1e-6, "Cp");
    assert_near(process.potential.nearest_index, (74.05 - 74.001_176) / (3.0 * sigma), 1e-6, "Cpk");
    assert_eq!((process.n, process.notes.as_slice(), process.verdict), (125, &[][..], Verdict::Capable));
}

#[test]
fn one_sided_limits_have_no_cp_and_count_one_side() {
    let values = values(50, 16.0, 2.0);
    let upper = evaluate(&values, SpecificationLimits { lower: None, upper: Some(20.0) }).performance;
    let lower = evaluate(&values, SpecificationLimits { lower: Some(8.0), upper: None }).performance;
    assert_eq!((upper.tolerance_index, lower.tolerance_index), (None, None));
    assert_near(upper.nearest_index, 2.0 / 3.0, ROUNDING, "upper");
    assert_near(lower.nearest_index, 4.0 / 3.0, ROUNDING, "lower");
    assert_eq!((upper.nonconforming.below_ppm, lower.nonconforming.above_ppm), (None, None));
    assert_near(lower.nonconforming.total_ppm, 31.67, 0.01, "total");
}

#[test]
fn a_mean_outside_the_limits_gives_a_negative_index() {
    let process = evaluate(&values(50, 21.0, 2.0), limits(8.0, 20.0));
    assert_near(process.performance.nearest_index, -1.0 / 6.0, ROUNDING, "Ppk");
    assert_eq!(process.verdict, Verdict::NotCapable);
}

#[test]
fn fewer_than_25_values_have_no_verdict_and_say_so() {
    let mut values = measured(&normal_values(41, 27));
    values[3] = None;
    values[9] = Some(f64::NAN);
    let wide = limits(-10.0, 10.0);
    let process = evaluate(&values, wide);
    assert_eq!((process.n, process.n_missing, process.verdict), (25, 2, Verdict::Capable));
    values[20] = None;
    let process = evaluate(&values, wide);
    assert_eq!((process.n, process.n_missing, process.verdict), (24, 3, Verdict::Undecided));
    assert_eq!(process.notes, [Note::TooFewValues { n: 24, needed: 25 }]);
    let process = evaluate(&values[..5], wide);
    assert_eq!(process.normality, None);
    let expected = [Note::TooFewValues { n: 4, needed: 25 }, Note::NormalityNotTested { n: 4, needed: 8 }];
    assert_eq!(process.notes, expected);
}

#[test]
fn values_that_are_not_normal_are_noted() {
    let lognormal: Vec<f64> = normal_values(42, 200).iter().map(|value| value.exp()).collect();
    let process = evaluate(&measured(&lognormal), limits(-10.0, 50.0));
    let p_value = process.normality.unwrap().p_value;
    assert_eq!(process.notes, [Note::NotNormal { p_value }]);
    assert!(p_value < 0.001);
    assert_eq!(evaluate(&measured(&normal_values(43, 200)), limits(-10.0, 50.0)).notes, []);
}

#[test]
fn a_drift_lowers_ppk_and_not_cpk() {
    let noise = normal_values(44, 200);
    let drifting: Vec<f64> = noise.iter().enumerate().map(|(idx, value)| value + 0.05 * idx as f64).collect();
    let process = evaluate(&measured(&drifting), limits(-10.0, 20.0));
    let expected = 1.0 / 12.0 * 10.0_f64.powi(2); // variance of a uniform drift over 10
    assert_near(process.sigma_within.sigma, 1.0, 0.2, "σ within"); // 3 σ of 123 degrees of freedom
    assert_near(process.sigma_overall, (1.0 + expected).sqrt(), 0.3, "σ overall");
    assert!(process.potential.nearest_index > 2.0 * process.performance.nearest_index);
}

/// Coverage of the approximate intervals of Cpk and Ppk for a process with Cpk = 1.333, 50 values each.
#[test]
fn intervals_cover_the_true_index_as_often_as_stated() {
    let n_processes = 6000;
    let values = normal_values(45, 50 * n_processes);
    let limits = limits(-4.0, 6.0);
    let covered = |interval: (f64, f64)| f64::from(interval.0 < 4.0 / 3.0 && 4.0 / 3.0 < interval.1);
    let (mut of_potential, mut of_performance) = (0.0, 0.0);
    for sample in values.chunks(50) {
        let process = evaluate(&measured(sample), limits);
        of_potential += covered(process.potential.interval);
        of_performance += covered(process.performance.interval);
    }
    // 4 σ of the simulation are 0.011; the approximation itself is good to about 0.01.
    assert_near(of_potential / n_processes as f64, 0.95, 0.02, "coverage of Cpk");
    assert_near(of_performance / n_processes as f64, 0.95, 0.02, "coverage of Ppk");
}

#[test]
fn shift_scale_and_mirror_change_no_index() {
    let values = normal_values(46, 60);
    let moved: Vec<f64> = values.iter().map(|value| 500.0 - 3.0 * value).collect();
    let plain = evaluate(&measured(&values), limits(-3.0, 5.0));
    let moved = evaluate(&measured(&moved), limits(485.0, 509.0));
    for (plain, moved) in [(plain.potential, moved.potential), (plain.performance, moved.performance)] {
        assert_near(moved.nearest_index, plain.nearest_index, ROUNDING, "Cpk");
        assert_near(moved.tolerance_index.unwrap(), plain.tolerance_index.unwrap(), ROUNDING, "Cp");
        let [below, above] = [plain.nonconforming.below_ppm, moved.nonconforming.above_ppm].map(Option::unwrap);
        assert_near(below, above, 1e-6 * below, "parts per million");
    }
}

#[test]
fn impossible_requests_are_refused() {
    let values = values(50, 16.0, 2.0);
    let refuse = |values: &[Option<f64>], lower, upper, grouping| {
        let limits = SpecificationLimits { lower, upper };
        process_capability(&ProcessRequest { values, limits, grouping }).unwrap_err()
    };
    let single = Grouping::Individuals;
    assert_eq!(refuse(&values, None, None, single), ProcessError::NoLimits);
    let reversed = ProcessError::LimitsReversed { lower: 2.0, upper: 2.0 };
    assert_eq!(refuse(&values, Some(2.0), Some(2.0), single), reversed);
    let infinite = ProcessError::LimitNotFinite { limit: f64::INFINITY };
    assert_eq!(refuse(&values, Some(2.0), Some(f64::INFINITY), single), infinite);
    assert_eq!(refuse(&values[..1], Some(2.0), None, single), ProcessError::TooFewValues { n: 1 });
    assert_eq!(refuse(&[Some(1.0); 30], Some(0.0), None, single), ProcessError::NoScatter);
    for size in [0, 1] {
        let error = refuse(&values, Some(2.0), None, Grouping::Subgroups { size });
        assert_eq!(error, ProcessError::TooFewValues { n: 50 });
    }
}
