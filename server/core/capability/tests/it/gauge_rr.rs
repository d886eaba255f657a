//! Gauge R&R of the example of AIAG MSA 4, and of studies with known components.
//! Not shown: the coverage of percentages; with 10 parts they are uncertain by about a quarter.

use capability::gauge_rr::{
    Acceptance, Component, GaugeRr, GaugeRrError, Method, Reading, Source, Study, StudyError, acceptance, anova,
    average_and_range,
};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

/// AIAG MSA 4 (2010), figure III-B 15: ten parts, three trials each of appraisers A, B and C.
const AIAG: [[f64; 9]; 10] = [
    [0.29, 0.41, 0.64, 0.08, 0.25, 0.07, 0.04, -0.11, -0.15],
    [-0.56, -0.68, -0.58, -0.47, -1.22, -0.68, -1.38, -1.13, -0.96],
    [1.34, 1.17, 1.27, 1.19, 0.94, 1.34, 0.88, 1.09, 0.67],
    [0.47, 0.50, 0.64, 0.01, 1.03, 0.20, 0.14, 0.20, 0.11],
    [-0.80, -0.92, -0.84, -0.56, -1.20, -1.28, -1.46, -1.07, -1.45],
    [0.02, -0.11, -0.21, -0.20, 0.22, 0.06, -0.29, -0.67, -0.49],
    [0.59, 0.75, 0.66, 0.47, 0.55, 0.83, 0.02, 0.01, 0.21],
    [-0.31, -0.20, -0.17, -0.63, 0.08, -0.34, -0.46, -0.56, -0.49],
    [2.26, 1.99, 2.01, 1.80, 2.12, 2.19, 1.77, 1.45, 1.87],
    [-1.36, -1.25, -1.31, -1.68, -1.62, -1.50, -1.49, -1.77, -2.16],
];

/// Study of `n_operators` × `n_trials` values per part, operator by operator.
fn study<const N: usize>(parts: &[[f64; N]], n_trials: usize) -> Study {
    Study::new(&readings(&named(parts, n_trials))).unwrap()
}

type Named = (String, String, Option<f64>);

fn named<const N: usize>(parts: &[[f64; N]], n_trials: usize) -> Vec<Named> {
    let of_part = |(part_idx, values): (usize, &[f64; N])| {
        values.map(Some).into_iter().enumerate().map(move |(idx, value)| {
            (format!("{}", part_idx + 1), ["A", "B", "C"][idx / n_trials].to_owned(), value)
        })
    };
    parts.iter().enumerate().flat_map(of_part).collect()
}

fn readings(named: &[Named]) -> Vec<Reading<'_>> {
    named.iter().map(|(part, operator, value)| Reading { part, operator, value: *value }).collect()
}

fn assert_near(got: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((got - expected).abs() <= tolerance, "{what}: {got} is not {expected}");
}

fn assert_deviations(result: &GaugeRr, [ev, av, grr, pv, tv]: [f64; 5], tolerance: f64) {
    assert_near(result.repeatability.std_dev, ev, tolerance, "EV");
    assert_near(result.reproducibility.unwrap().std_dev, av, tolerance, "AV");
    assert_near(result.gauge_rr.std_dev, grr, tolerance, "GRR");
    assert_near(result.part_variation.std_dev, pv, tolerance, "PV");
    assert_near(result.total_variation.std_dev, tv, tolerance, "TV");
}

/// AIAG MSA 4, figure III-B 16. The manual multiplies ranges rounded to four digits by constants rounded to four digits.
#[test]
fn averages_and_ranges_of_the_aiag_example_are_the_printed_ones() {
    let result = average_and_range(&study(&AIAG, 3), Some(9.0)).unwrap();
    let rounding = 2e-4;
    assert_deviations(&result, [0.20188, 0.22963, 0.30575, 1.10456, 1.14610], rounding);
    let Method::AverageAndRange { k1, k2, k3 } = result.method else { panic!("another method") };
    assert_near(k1, 0.5908, 5e-5, "K1");
    assert_near(k2.unwrap(), 0.5231, 5e-5, "K2");
    assert_near(k3, 0.3146, 5e-5, "K3");
    let percent = |component: Component| component.percent_of_total;
    assert_near(percent(result.repeatability), 17.62, 0.01, "%EV");
    assert_near(percent(result.reproducibility.unwrap()), 20.04, 0.01, "%AV");
    assert_near(percent(result.gauge_rr), 26.68, 0.01, "%GRR");
    assert_near(percent(result.part_variation), 96.37, 0.01, "%PV");
    assert_eq!((result.ndc, result.interaction), (Some(5), None));
    assert_near(result.gauge_rr.percent_of_tolerance.unwrap(), 100.0 * 6.0 * 0.30575 / 9.0, 0.02, "%T");
    assert_eq!(acceptance(percent(result.gauge_rr)), Acceptance::Conditional);
}

/// AIAG MSA 4, tables III-B 7 and 8: the interaction is pooled.
#[test]
fn the_analysis_of_variance_of_the_aiag_example_is_the_printed_one() {
    let result = anova(&study(&AIAG, 3), None).unwrap();
    assert_deviations(&result, [0.199_933, 0.226_838, 0.302_373, 1.042_327, 1.085], 3e-4);
    assert_near(result.repeatability.std_dev, 0.199_933, 5e-7, "EV");
    assert_near(result.gauge_rr.std_dev, 0.302_373, 2e-6, "GRR");
    assert_eq!((result.ndc, result.interaction), (Some(4), None));
    assert_near(result.gauge_rr.percent_of_total, 27.9, 0.05, "%GRR");
    let Method::Anova { table, interaction_test: Some(test) } = result.method else { panic!("no test") };
    assert!(test.pooled);
    assert_near(test.f.unwrap(), 0.434, 5e-4, "F of the interaction");
    assert_near(test.p_value.unwrap(), 0.974, 5e-4, "p of the interaction");
    let printed = [
        (Source::Part, 9, 88.3619, Some(245.614)),
        (Source::Operator, 2, 3.1673, Some(39.617)),
        (Source::Repeatability, 78, 2.7589 + 0.3590, None),
    ];
    assert_eq!(table.len(), printed.len());
    for (row, (source, dof, sum, f)) in table.iter().zip(printed) {
        assert_eq!((row.source, row.dof, row.f.is_some()), (source, dof, f.is_some()));
        assert_near(row.sum_of_squares, sum, 1e-4, "sum of squares");
        assert_near(row.f.unwrap_or(0.0), f.unwrap_or(0.0), 5e-4, "F");
    }
}

/// Two parts, two operators, two trials; means 1, 3 and 5, 15; every cell mean ± 1. By hand: grand mean 6, part means 2
/// and 10, operator means 3 and 9, SSp = 4·32, SSo = 4·18, SSpo = 2·4·4, SSe = 8, F of the interaction = 32/(8/4) = 16
/// with p = 0.016.
#[test]
fn an_interaction_calculated_by_hand_is_kept() {
    let result = anova(&study(&[[0.0, 2.0, 2.0, 4.0], [4.0, 6.0, 14.0, 16.0]], 2), None).unwrap();
    let Method::Anova { table, interaction_test: Some(test) } = &result.method else { panic!("no test") };
    let sums: Vec<f64> = table.iter().map(|row| row.sum_of_squares).collect();
    for (got, expected) in sums.iter().zip([128.0, 72.0, 32.0, 8.0]) {
        assert_near(*got, expected, 1e-12, "sum of squares");
    }
    assert!(!test.pooled);
    assert_near(test.f.unwrap(), 16.0, 1e-12, "F");
    assert_near(test.p_value.unwrap(), 0.016_13, 1e-5, "p"); // t = 4 with 4 degrees of freedom
    // EV² = 2, INT² = (32 − 2)/2 = 15, AV² = (72 − 32)/4 = 10, PV² = (128 − 32)/4 = 24.
    let variance = |component: Component| component.std_dev.powi(2);
    assert_near(variance(result.repeatability), 2.0, 1e-12, "EV²");
    assert_near(variance(result.interaction.unwrap()), 15.0, 1e-12, "INT²");
    assert_near(variance(result.reproducibility.unwrap()), 10.0, 1e-12, "AV²");
    assert_near(variance(result.gauge_rr), 27.0, 1e-12, "GRR²");
    assert_near(variance(result.part_variation), 24.0, 1e-12, "PV²");
    assert_eq!(result.ndc, Some(1)); // 1.41·√(24/27) = 1.33
}

#[test]
fn negative_components_of_variance_are_zero() {
    // Operators with equal means, parts with equal means.
    let study = study(&[[0.0, 2.0, 0.0, 2.0], [0.0, 2.0, 2.0, 0.0]], 2);
    for result in [anova(&study, None).unwrap(), average_and_range(&study, None).unwrap()] {
        assert_eq!(result.reproducibility.unwrap().std_dev, 0.0);
        assert_eq!((result.part_variation.std_dev, result.ndc), (0.0, Some(0)));
        assert_near(result.gauge_rr.percent_of_total, 100.0, 1e-12, "%GRR");
    }
}

/// One operator: one-way analysis of variance. Means 1 and 5, values ± 1: MSe = 2, MSp = 16, PV² = (16 − 2)/2.
#[test]
fn a_study_with_one_operator_has_no_reproducibility() {
    let study = study(&[[0.0, 2.0], [4.0, 6.0]], 2);
    let result = anova(&study, None).unwrap();
    assert_eq!((result.reproducibility, result.interaction), (None, None));
    assert_near(result.repeatability.std_dev, 2.0_f64.sqrt(), 1e-12, "EV");
    assert_near(result.part_variation.std_dev, 7.0_f64.sqrt(), 1e-12, "PV");
    assert_eq!(result.gauge_rr, result.repeatability);
    // d2*(2, 2 ranges) = √(4/π + (2 − 4/π)/2) = √(1 + 2/π) and d2*(2, 1) = √2.
    let result = average_and_range(&study, None).unwrap();
    let d2_star = (1.0 + std::f64::consts::FRAC_2_PI).sqrt();
    assert_near(result.repeatability.std_dev, 2.0 / d2_star, 1e-6, "EV");
    assert_near(result.part_variation.std_dev, 4.0 / 2.0_f64.sqrt(), 1e-5, "PV");
    assert_eq!(result.reproducibility, None);
}

/// Many parts and operators, so that the estimates are precise.
#[test]
fn simulated_components_are_recovered() {
    let mut random = Pcg64::seed_from_u64(11);
    let mut draw = |sigma: f64| Normal::new(0.0, sigma).unwrap().sample(&mut random);
    let (n_parts, n_operators, n_trials) = (60, 60, 3);
    let operators: Vec<f64> = (0..n_operators).map(|_| draw(2.0)).collect();
    let mut named: Vec<Named> = Vec::new();
    for part in 0..n_parts {
        let of_part = draw(4.0);
        for (operator, of_operator) in operators.iter().enumerate() {
            let of_both = draw(0.5);
            for _ in 0..n_trials {
                let value = of_part + of_operator + of_both + draw(1.0);
                named.push((part.to_string(), operator.to_string(), Some(value)));
            }
        }
    }
    let result = anova(&Study::new(&readings(&named)).unwrap(), None).unwrap();
    // Three σ: relative 1/√(2ν) with ν = 59 for parts and operators, 7200 for trials; interaction by its mean square.
    assert_near(result.part_variation.std_dev, 4.0, 3.0 * 4.0 / 118.0_f64.sqrt(), "PV");
    assert_near(result.reproducibility.unwrap().std_dev, 2.0, 3.0 * 2.0 / 118.0_f64.sqrt(), "AV");
    assert_near(result.repeatability.std_dev, 1.0, 3.0 / 14_400.0_f64.sqrt(), "EV");
    assert_near(result.interaction.unwrap().std_dev, 0.5, 0.05, "interaction");
}

#[test]
fn shift_changes_nothing_and_scale_changes_only_the_standard_deviations() {
    let plain = study(&AIAG, 3);
    let moved = study(&AIAG.map(|part| part.map(|value| 1000.0 - 4.0 * value)), 3);
    for method in [anova, average_and_range] {
        let (plain, moved) = (method(&plain, Some(3.0)).unwrap(), method(&moved, Some(12.0)).unwrap());
        let pairs = [
            (plain.repeatability, moved.repeatability),
            (plain.reproducibility.unwrap(), moved.reproducibility.unwrap()),
            (plain.gauge_rr, moved.gauge_rr),
            (plain.part_variation, moved.part_variation),
        ];
        for (plain, moved) in pairs {
            assert_near(moved.std_dev, 4.0 * plain.std_dev, 1e-9, "standard deviation");
            assert_near(moved.percent_of_total, plain.percent_of_total, 1e-8, "% of total");
            let percent = plain.percent_of_tolerance.unwrap();
            assert_near(moved.percent_of_tolerance.unwrap(), percent, 1e-8, "% of tolerance");
        }
        assert_eq!(plain.ndc, moved.ndc);
    }
}

#[test]
fn the_order_of_parts_and_operators_does_not_matter() {
    let mut named = named(&AIAG, 3);
    named.reverse();
    let reversed = anova(&Study::new(&readings(&named)).unwrap(), None).unwrap();
    let plain = anova(&study(&AIAG, 3), None).unwrap();
    assert_near(reversed.gauge_rr.std_dev, plain.gauge_rr.std_dev, 1e-12, "GRR");
    assert_near(reversed.part_variation.std_dev, plain.part_variation.std_dev, 1e-12, "PV");
}

#[test]
fn an_unbalanced_study_names_the_cell() {
    let complete = named(&AIAG, 3);
    let mut short = complete.clone();
    short.remove(9 * 6 + 4); // part 7, operator B
    assert_eq!(
        Study::new(&readings(&short)).unwrap_err().to_string(),
        "operator B measured part 7 2 times instead of 3"
    );
    let absent: Vec<Named> = complete
        .iter()
        .filter(|(part, operator, _)| (part.as_str(), operator.as_str()) != ("3", "C"))
        .cloned()
        .collect();
    assert_eq!(
        Study::new(&readings(&absent)),
        Err(StudyError::Unbalanced { part: "3".into(), operator: "C".into(), n: 0, n_trials: 3 })
    );
    let mut missing = complete;
    missing[9 + 5].2 = None; // part 2, operator B, third trial
    assert_eq!(
        Study::new(&readings(&missing)),
        Err(StudyError::MissingMeasurement { part: "2".into(), operator: "B".into(), trial: 3 })
    );
}

#[test]
fn too_small_studies_are_refused() {
    assert_eq!(Study::new(&[]), Err(StudyError::TooFewParts { n: 0 }));
    assert_eq!(Study::new(&readings(&named(&[[1.0, 2.0]], 2))), Err(StudyError::TooFewParts { n: 1 }));
    let once = named(&[[1.0, 2.0], [3.0, 4.0]], 1);
    assert_eq!(Study::new(&readings(&once)), Err(StudyError::TooFewTrials { n: 1 }));
}

#[test]
fn studies_without_result_are_refused() {
    let equal = study(&[[0.1; 6]; 3], 3);
    assert_eq!(anova(&equal, None), Err(GaugeRrError::NoVariation));
    assert_eq!(average_and_range(&equal, None), Err(GaugeRrError::NoVariation));
    assert_eq!(anova(&study(&AIAG, 3), Some(0.0)), Err(GaugeRrError::Tolerance { tolerance: 0.0 }));
    let many: Vec<[f64; 2]> = (0..21).map(|idx| [f64::from(idx), f64::from(idx) + 0.5]).collect();
    let too_many = GaugeRrError::TooManyForRanges { quantity: "parts", n: 21, max: 20 };
    assert_eq!(average_and_range(&study(&many, 2), None), Err(too_many));
    assert!(anova(&study(&many, 2), None).is_ok());
}

/// Without scatter between trials there is nothing to test against, but components exist.
#[test]
fn a_measuring_system_without_scatter_has_an_unlimited_number_of_categories() {
    let result = anova(&study(&[[1.0, 1.0], [2.0, 2.0], [4.0, 4.0]], 2), None).unwrap();
    assert_eq!((result.gauge_rr.std_dev, result.ndc), (0.0, None));
    assert_near(result.part_variation.percent_of_total, 100.0, 1e-12, "%PV");
}
