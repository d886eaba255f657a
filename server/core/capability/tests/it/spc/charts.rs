//! Control limits of published examples and of simulated values.

use capability::spc::{ChartError, ControlLimits, beyond_limits, individuals_chart, means_chart};

use crate::examples::{FLOW_RATE, PISTON_RINGS, measured, normal_values};

fn assert_limits(got: ControlLimits, [lower, centre, upper]: [f64; 3], tolerance: f64) {
    for (got, expected) in [(got.lower, lower), (got.centre, centre), (got.upper, upper)] {
        assert!((got - expected).abs() <= tolerance, "{got} is not {expected}");
    }
}

/// NIST/SEMATECH e-Handbook, 6.3.2.2, which uses d2 = 1.128 instead of 1.128379.
#[test]
fn limits_of_the_flow_rate_are_those_of_the_handbook() {
    let chart = individuals_chart(&measured(&FLOW_RATE)).unwrap();
    let rounding_of_d2 = 3.0 * 1.8778 / 1.128 * 4e-4;
    assert_limits(chart.individuals, [45.8159, 50.81, 55.8041], rounding_of_d2);
    assert_limits(chart.moving_range, [0.0, 1.8778, 3.267 * 1.8778], 1e-3);
    assert_eq!((chart.n, chart.n_missing, chart.preliminary), (10, 0, true));
    assert_eq!(beyond_limits(&measured(&FLOW_RATE), &chart.individuals), []);
}

/// R package qcc, `qcc(pistonrings, type = "S")`: centre 0.009240037, standard deviation 0.009829977, upper limit
/// 0.019302416. Means: 74.001176 ± 3·0.009829977/√5.
#[test]
fn limits_of_the_piston_rings_are_those_of_qcc() {
    let chart = means_chart(&measured(PISTON_RINGS.as_flattened()), 5).unwrap();
    let printed = 5e-9;
    assert_limits(chart.std_devs_limits, [0.0, 0.009_240_037, 0.019_302_416], printed);
    assert!((chart.sigma.sigma - 0.009_829_977).abs() < printed);
    let width = 3.0 * 0.009_829_977 / 5.0_f64.sqrt();
    assert_limits(chart.means_limits, [74.001_176 - width, 74.001_176, 74.001_176 + width], 2e-8);
    assert_eq!((chart.n_subgroups, chart.n_incomplete, chart.n_left_over, chart.preliminary), (25, 0, 0, false));
    assert_eq!(beyond_limits(&chart.means, &chart.means_limits), []);
}

/// One value differs: 1, 1, 4, 1, 1 has the moving ranges 0, 3, 3, 0.
#[test]
fn a_gap_takes_its_moving_ranges_along() {
    let chart = individuals_chart(&measured(&[1.0, 1.0, 4.0, 1.0, 1.0])).unwrap();
    assert!((chart.moving_range.centre - 1.5).abs() < 1e-12);
    let with_gap = [Some(1.0), Some(1.0), Some(4.0), None, Some(1.0), Some(1.0)];
    let chart = individuals_chart(&with_gap).unwrap();
    assert!((chart.moving_range.centre - 1.0).abs() < 1e-12);
    assert_eq!((chart.n, chart.n_missing, chart.sigma.n_used), (5, 1, 3));
    assert_eq!(chart.moving_ranges, [None, Some(0.0), Some(3.0), None, None, Some(0.0)]);
}

#[test]
fn a_subgroup_with_a_gap_is_a_gap_and_values_left_over_are_counted() {
    let mut values = measured(&[1.0, 3.0, 2.0, 4.0, 5.0, 9.0, 7.0]);
    values[2] = None;
    let chart = means_chart(&values, 2).unwrap();
    assert_eq!((chart.n_subgroups, chart.n_incomplete, chart.n_left_over), (2, 1, 1));
    assert_eq!(chart.means, [Some(2.0), None, Some(7.0)]);
    assert_eq!(chart.means_limits.centre, 4.5);
}

#[test]
fn only_points_outside_the_limits_are_beyond_them() {
    let limits = ControlLimits { lower: -1.0, centre: 0.0, upper: 2.0 };
    let points = [Some(-1.0), Some(-1.1), None, Some(2.0), Some(2.1), Some(f64::NAN)];
    assert_eq!(beyond_limits(&points, &limits), [1, 4]);
}

/// The estimate of σ is unbiased, and its scatter is that of the degrees of freedom.
#[test]
fn sigma_of_simulated_baselines_has_the_stated_degrees_of_freedom() {
    let n_baselines = 4000;
    for (size, seed) in [(1, 21), (4, 22)] {
        let values = normal_values(seed, 40 * n_baselines);
        let estimates = values.chunks(40).map(|baseline| match size {
            1 => individuals_chart(&measured(baseline)).unwrap().sigma,
            _ => means_chart(&measured(baseline), size).unwrap().sigma,
        });
        let estimates: Vec<_> = estimates.collect();
        let n = n_baselines as f64;
        let mean = estimates.iter().map(|estimate| estimate.sigma).sum::<f64>() / n;
        let variance = estimates.iter().map(|estimate| (estimate.sigma - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let expected = 0.5 / estimates[0].dof;
        assert!((mean - 1.0).abs() < 4.0 * (expected / n).sqrt(), "size {size}: mean {mean}"); // 4 σ
        assert!((variance / expected - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "size {size}: variance {variance}"); // 4 σ
    }
}

#[test]
fn baselines_without_an_estimate_of_sigma_are_refused() {
    let alternating = [Some(1.0), None, Some(2.0), None, Some(3.0)];
    assert_eq!(individuals_chart(&alternating), Err(ChartError::TooFewValues { n: 3 }));
    assert_eq!(means_chart(&alternating, 2), Err(ChartError::TooFewValues { n: 3 }));
    assert_eq!(means_chart(&alternating, 1), Err(ChartError::SubgroupSize { size: 1 }));
    assert_eq!(means_chart(&alternating, 0), Err(ChartError::SubgroupSize { size: 0 }));
    assert_eq!(individuals_chart(&[]), Err(ChartError::TooFewValues { n: 0 }));
}
