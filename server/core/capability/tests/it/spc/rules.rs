//! Run rules: patterns that just are and just are not violations, and false alarms of stable processes.

use capability::spc::{Rule, Violation, violations};
use proptest::prelude::{ProptestConfig, prop_assert_eq, proptest};

use crate::examples::{measured, normal_values};

const ALL: [Rule; 9] = [
    Rule::BeyondThreeSigma,
    Rule::NineOnOneSide,
    Rule::SixTrending,
    Rule::FourteenAlternating,
    Rule::TwoOfThreeBeyondTwoSigma,
    Rule::FourOfFiveBeyondOneSigma,
    Rule::FifteenWithinOneSigma,
    Rule::EightBeyondOneSigma,
    Rule::EightOnOneSide,
];

/// Ranges of the violations of `rule` with centre 0 and σ = 1.
fn ranges(rule: Rule, points: &[Option<f64>]) -> Vec<(usize, usize)> {
    violations(points, 0.0, 1.0, &[rule]).iter().map(|one| (one.first_idx, one.last_idx)).collect()
}

/// `points` violate `rule` as a whole; without their last point, with `spoilt` as last point, and with a gap before the
/// last point they do not.
fn check(rule: Rule, points: &[f64], spoilt: f64) {
    let last_idx = points.len() - 1;
    assert_eq!(points.len(), rule.n_points());
    let points = measured(points);
    assert_eq!(ranges(rule, &points), [(0, last_idx)], "{rule:?}");
    assert_eq!(ranges(rule, &points[..last_idx]), [], "{rule:?} one point short");
    let mut other = points.clone();
    other[last_idx] = Some(spoilt);
    assert_eq!(ranges(rule, &other), [], "{rule:?} spoilt");
    let mut gap = points.clone();
    gap.insert(last_idx, None);
    let expected: &[(usize, usize)] = if last_idx == 0 { &[(1, 1)] } else { &[] };
    assert_eq!(ranges(rule, &gap), expected, "{rule:?} with a gap");
}

#[test]
fn every_rule_has_its_pattern_on_both_sides() {
    for sign in [1.0, -1.0] {
        let check = |rule, points: &[f64], spoilt: f64| {
            check(rule, &points.iter().map(|point| sign * point).collect::<Vec<_>>(), sign * spoilt);
        };
        check(Rule::BeyondThreeSigma, &[3.01], 3.0);
        check(Rule::NineOnOneSide, &[0.1, 0.5, 0.2, 2.0, 0.1, 0.3, 0.1, 0.9, 0.1], 0.0);
        check(Rule::EightOnOneSide, &[0.1, 0.5, 0.2, 2.0, 0.1, 0.3, 0.1, 0.9], -0.1);
        check(Rule::SixTrending, &[-2.0, -1.0, -0.5, 0.1, 0.2, 0.3], 0.2);
        let alternating = [0.1, 0.5, 0.2, 0.3, 0.1, 0.2, 0.1, 0.4, 0.2, 0.3, 0.0, 1.0, 0.5, 0.6];
        check(Rule::FourteenAlternating, &alternating, 0.5);
        check(Rule::TwoOfThreeBeyondTwoSigma, &[2.1, 0.0, 2.1], 2.0);
        check(Rule::FourOfFiveBeyondOneSigma, &[1.1, 1.2, -0.5, 1.1, 1.5], 1.0);
        let within = [0.5, -0.5, 0.9, -1.0, 0.0, 0.1, 1.0, 0.2, -0.3, 0.4, 0.6, -0.8, 0.1, 0.2, 0.3];
        check(Rule::FifteenWithinOneSigma, &within, 1.01);
        check(Rule::EightBeyondOneSigma, &[1.1, -1.1, 1.5, 2.0, -1.2, 1.1, -1.4, 1.3], 1.0);
    }
}

/// The points beyond two and one σ must be on the same side, and the last must be one of them.
#[test]
fn points_on_opposite_sides_or_a_last_point_inside_are_no_zone_violation() {
    for points in [[2.1, 0.0, -2.1], [2.1, 2.1, 0.0]] {
        assert_eq!(ranges(Rule::TwoOfThreeBeyondTwoSigma, &measured(&points))[..], [][..]);
    }
    for points in [[1.1, 1.1, -1.1, -1.1, 1.1], [1.1, 1.1, 1.1, 1.1, 0.0]] {
        assert_eq!(ranges(Rule::FourOfFiveBeyondOneSigma, &measured(&points))[..], [][..]);
    }
}

#[test]
fn a_pattern_that_continues_is_one_violation_and_a_new_one_another() {
    let mut points = vec![Some(-0.5)];
    points.extend([Some(0.5); 11]);
    points.push(None);
    points.extend([Some(-0.5); 9]);
    assert_eq!(ranges(Rule::NineOnOneSide, &points), [(1, 11), (13, 21)]);
}

#[test]
fn rules_are_selected_and_their_order_is_kept() {
    let points = measured(&[4.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5]);
    let one_side = Violation { rule: Rule::EightOnOneSide, first_idx: 0, last_idx: 7 };
    let beyond = Violation { rule: Rule::BeyondThreeSigma, first_idx: 0, last_idx: 0 };
    assert_eq!(violations(&points, 0.0, 1.0, &Rule::WESTERN_ELECTRIC), [beyond, one_side]);
    assert_eq!(violations(&points, 0.0, 1.0, &[Rule::EightOnOneSide, Rule::BeyondThreeSigma]), [one_side, beyond]);
    assert_eq!(violations(&points, 0.0, 1.0, &Rule::NELSON), [beyond]);
}

#[test]
fn values_that_are_not_finite_are_gaps() {
    let mut points = vec![Some(0.5); 9];
    points[4] = Some(f64::NAN);
    assert_eq!(ranges(Rule::NineOnOneSide, &points), []);
    assert_eq!(ranges(Rule::BeyondThreeSigma, &[Some(f64::INFINITY)]), []);
}

/// Probability that independent normal points show the pattern of `rule`, from Φ and counting.
fn false_alarm_rate(rule: Rule) -> f64 {
    // 1 − Φ(1), 1 − Φ(2), 1 − Φ(3), from tables.
    let [beyond_1, beyond_2, beyond_3] = [0.158_655_3, 0.022_750_1, 0.001_349_9];
    match rule {
        Rule::BeyondThreeSigma => 2.0 * beyond_3,
        Rule::NineOnOneSide => 2.0 / 512.0,
        Rule::EightOnOneSide => 2.0 / 256.0,
        // Of 6! orders one rises and one falls.
        Rule::SixTrending => 2.0 / 720.0,
        // The number of alternating orders of 14 values is twice the Euler number 199 360 981, of 14! orders.
        Rule::FourteenAlternating => 2.0 * 199_360_981.0 / 87_178_291_200.0,
        Rule::TwoOfThreeBeyondTwoSigma => 2.0 * beyond_2 * (1.0 - (1.0 - beyond_2).powi(2)),
        Rule::FourOfFiveBeyondOneSigma => {
            2.0 * beyond_1 * (4.0 * beyond_1.powi(3) * (1.0 - beyond_1) + beyond_1.powi(4))
        }
        Rule::FifteenWithinOneSigma => (1.0 - 2.0 * beyond_1).powi(15),
        Rule::EightBeyondOneSigma => (2.0 * beyond_1).powi(8),
    }
}

#[test]
fn false_alarms_of_a_stable_process_are_as_frequent_as_theory_says() {
    for (seed, rule) in (100..).zip(ALL) {
        let rate = false_alarm_rate(rule);
        let n_windows = (1000.0 / rate) as usize; // about 1000 alarms: 3 % (one σ)
        let n_windows = n_windows.min(1_000_000);
        let values = measured(&normal_values(seed, n_windows * rule.n_points()));
        let is_alarm = |window: &&[Option<f64>]| !violations(window, 0.0, 1.0, &[rule]).is_empty();
        let n_alarms = values.chunks(rule.n_points()).filter(is_alarm).count() as f64;
        let expected = rate * n_windows as f64;
        assert!((n_alarms - expected).abs() < 4.0 * expected.sqrt(), "{rule:?}: {n_alarms}, expected {expected}"); // 4 σ
    }
}

/// Mean number of points up to the first false alarm: 91.75 for the rules of Western Electric (Champ & Woodall 1987), 73.5
/// for those of Nelson (an independent simulation of 6000 runs, ± 0.9).
#[test]
fn false_alarms_of_sets_of_rules_are_as_far_apart_as_published() {
    let (n_runs, n_points) = (2000, 1000); // a run without alarm has a probability of 10⁻⁵
    let values = measured(&normal_values(200, n_runs * n_points));
    for (rules, expected) in [(&Rule::WESTERN_ELECTRIC[..], 91.75), (&Rule::NELSON[..], 73.5)] {
        let first_alarm = |points: &[Option<f64>]| {
            let found = violations(points, 0.0, 1.0, rules);
            found.iter().map(|one| one.first_idx + one.rule.n_points()).min().unwrap_or(n_points) as f64
        };
        let mean = values.chunks(n_points).map(first_alarm).sum::<f64>() / n_runs as f64;
        // 4 σ: the number of points is nearly geometrically distributed.
        assert!((mean - expected).abs() < 4.0 * expected / (n_runs as f64).sqrt(), "{mean}, expected {expected}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Multiples of 1/8 and factors that are powers of two, so that no comparison changes by rounding.
    #[test]
    fn shift_scale_and_mirror_change_no_violation(
        eighths in proptest::collection::vec(proptest::option::weighted(0.95, -26_i32..=26), 0..80),
        shift in -1000_i32..1000,
        exponent in -4_i32..4,
    ) {
        let points: Vec<Option<f64>> =
            eighths.iter().map(|point| point.map(|point| f64::from(point) / 8.0)).collect();
        let plain = violations(&points, 0.0, 1.0, &ALL);
        for factor in [2.0_f64.powi(exponent), -2.0_f64.powi(exponent)] {
            let moved = |point: f64| factor * point + f64::from(shift);
            let points: Vec<Option<f64>> = points.iter().map(|point| point.map(moved)).collect();
            prop_assert_eq!(&violations(&points, f64::from(shift), factor.abs(), &ALL), &plain);
        }
    }
}
