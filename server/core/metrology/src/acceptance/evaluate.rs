//! The result of an acceptance test from the figures of its positions.

use super::figures::{Ball, Figures, Plate, Position};
use super::heights::{Linearity, Repeatability, linearity, repeatability};
use super::plan::{AcceptancePlan, PlateTest, Procedure, RepeatabilityTest, SpherePairTest, SphereTest};
use super::test_uncertainty::{diameter, of_form_mm, of_standard_deviation, spacing};
use crate::interface::part_verdict::PartVerdict;
use crate::interface::verdict::{Limits, verdict};

/// A quantity with a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Probing error of form, all points but 3 ‰ (PF of VDI/VDE 2634).
    ProbingForm,
    /// Probing dispersion, 95 % of the points (P Form.Sph.D95 of ISO 10360-13).
    ProbingFormD95,
    /// Probing error of size (PS).
    ProbingSize,
    /// Sphere spacing error (SD).
    SphereSpacing,
    /// Flatness error, all points but 3 ‰ (F).
    Flatness,
    /// Flatness error, 95 % of the points (Form.Pla.D95).
    FlatnessD95,
    /// Deviation from the least-squares line of the heights.
    Linearity,
    /// Standard deviation of a single point.
    RepeatabilitySingle,
    /// Standard deviation of the mean height.
    RepeatabilityAveraged,
}

impl Quantity {
    /// Its name in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::ProbingForm => "probing_form",
            Self::ProbingFormD95 => "probing_form_d95",
            Self::ProbingSize => "probing_size",
            Self::SphereSpacing => "sphere_spacing",
            Self::Flatness => "flatness",
            Self::FlatnessD95 => "flatness_d95",
            Self::Linearity => "linearity",
            Self::RepeatabilitySingle => "repeatability_single",
            Self::RepeatabilityAveraged => "repeatability_averaged",
        }
    }

    /// The procedure that determines it.
    pub fn procedure(self) -> Procedure {
        match self {
            Self::ProbingForm | Self::ProbingFormD95 | Self::ProbingSize => Procedure::Sphere,
            Self::SphereSpacing => Procedure::SpherePair,
            Self::Flatness | Self::FlatnessD95 => Procedure::Plate,
            Self::Linearity => Procedure::Linearity,
            Self::RepeatabilitySingle | Self::RepeatabilityAveraged => Procedure::Repeatability,
        }
    }

    /// Whether it is a deviation with a sign; the others are never negative.
    fn is_signed(self) -> bool {
        matches!(self, Self::ProbingSize | Self::SphereSpacing | Self::Linearity)
    }
}

/// The error of one position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionError {
    /// Index of the position in the list given to [`evaluate`].
    pub position_idx: usize,
    /// The error, mm.
    pub error_mm: f64,
    /// Expanded uncertainty of the test (k = 2), mm; `None` if the temperature of a length is unknown.
    pub test_uncertainty_mm: Option<f64>,
}

/// A quantity with its limit and verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct QuantityResult {
    /// Which.
    pub quantity: Quantity,
    /// The largest permissible error, mm; `None` without a limit.
    pub mpe_mm: Option<f64>,
    /// The errors of its positions; a single one for a standard deviation, at the last position.
    pub errors: Vec<PositionError>,
    /// The error of largest magnitude, mm.
    pub worst_mm: Option<f64>,
    /// The worst verdict of the positions by ISO 14253-1; `None` without a limit, or before all positions are present.
    pub verdict: Option<PartVerdict>,
}

/// Positions that are still missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissingPositions {
    /// Of which procedure.
    pub procedure: Procedure,
    /// Positions present.
    pub n_present: usize,
    /// Positions needed.
    pub n_needed: usize,
}

/// The result of an acceptance test.
#[derive(Debug, Clone, PartialEq)]
pub struct AcceptanceResult {
    /// Every quantity of the planned procedures that has an error or a limit.
    pub quantities: Vec<QuantityResult>,
    /// Linearity, from three different heights on.
    pub linearity: Option<Linearity>,
    /// Repeatability, from two scans on.
    pub repeatability: Option<Repeatability>,
    /// What is still missing.
    pub missing: Vec<MissingPositions>,
    /// The verdict on the station: the worst of all quantities; `None` while something is missing.
    pub verdict: Option<PartVerdict>,
}

/// The result of the positions so far.
pub fn evaluate(plan: &AcceptancePlan, positions: &[Position]) -> AcceptanceResult {
    let missing = missing(plan, positions);
    let at_heights: Vec<(usize, f64, &Plate)> = plates(positions, Procedure::Linearity)
        .filter_map(|(idx, plate)| Some((idx, positions[idx].reference_mm?, plate)))
        .collect();
    let references_mm: Vec<f64> = at_heights.iter().map(|(_, reference_mm, _)| *reference_mm).collect();
    let linearity = linearity(&at_heights.iter().map(|(_, _, plate)| *plate).collect::<Vec<_>>(), &references_mm);
    let repeated: Vec<(usize, &Plate)> = plates(positions, Procedure::Repeatability).collect();
    let differences_mm: Vec<f64> = repeated.iter().filter_map(|(idx, _)| positions[*idx].difference_mm).collect();
    let repeatability =
        repeatability(&repeated.iter().map(|(_, plate)| *plate).collect::<Vec<_>>(), &differences_mm);

    let mut planned = Vec::new();
    planned.extend(plan.sphere.iter().flat_map(|test| of_sphere(test, positions)));
    planned.extend(plan.sphere_pair.iter().map(|test| of_pair(test, positions)));
    planned.extend(plan.plate.iter().flat_map(|test| of_plate(test, positions)));
    if let Some(test) = &plan.linearity {
        let of_line = linearity.iter().flat_map(|found| found.deviations_mm.iter().zip(&at_heights));
        let errors =
            of_line.map(|(deviation_mm, (idx, _, _))| error(*idx, *deviation_mm, Some(test.uncertainty_mm)));
        planned.push((Quantity::Linearity, test.mpe_linearity_mm, errors.collect()));
    }
    if let (Some(test), Some((last_idx, _))) = (&plan.repeatability, repeated.last()) {
        planned.extend(of_scans(test, repeatability.as_ref(), *last_idx));
    }
    let is_complete = |quantity: Quantity| missing.iter().all(|missing| missing.procedure != quantity.procedure());
    let quantities: Vec<QuantityResult> = planned
        .into_iter()
        .map(|(quantity, mpe_mm, errors)| judged(quantity, mpe_mm, errors, is_complete(quantity)))
        .collect();
    let verdict = quantities.iter().filter_map(|result| result.verdict).max().filter(|_| missing.is_empty());
    AcceptanceResult { quantities, linearity, repeatability, missing, verdict }
}

/// A quantity with its limit and the errors of its positions.
type Planned = (Quantity, Option<f64>, Vec<PositionError>);

fn plates(positions: &[Position], procedure: Procedure) -> impl Iterator<Item = (usize, &Plate)> {
    positions.iter().enumerate().filter_map(move |(idx, position)| match &position.figures {
        Figures::Plate(plate) if position.procedure == procedure => Some((idx, plate)),
        _ => None,
    })
}

fn of_sphere(test: &SphereTest, positions: &[Position]) -> [Planned; 3] {
    let balls = || {
        positions.iter().enumerate().filter_map(|(idx, position)| match &position.figures {
            Figures::Ball(ball) => Some((idx, position, ball)),
            _ => None,
        })
    };
    let form = |width: fn(&Ball) -> f64| -> Vec<PositionError> {
        balls().map(|(idx, _, ball)| error(idx, width(ball), Some(of_form_mm(test.form_mm)))).collect()
    };
    let size = |(idx, position, ball): (usize, &Position, &Ball)| {
        let calibrated = diameter(test, position.temperature_c);
        error(idx, ball.diameter_mm - calibrated.length_mm, calibrated.uncertainty_mm)
    };
    [
        (Quantity::ProbingForm, test.mpe_form_mm, form(|ball| ball.dispersion.range_mm)),
        (Quantity::ProbingFormD95, test.mpe_form_d95_mm, form(|ball| ball.dispersion.d95_mm)),
        (Quantity::ProbingSize, test.mpe_size_mm, balls().map(size).collect()),
    ]
}

fn of_pair(test: &SpherePairTest, positions: &[Position]) -> Planned {
    let deviation = |(idx, position): (usize, &Position)| match &position.figures {
        Figures::Pair { distance_mm, .. } => {
            let calibrated = spacing(test, position.temperature_c);
            Some(error(idx, distance_mm - calibrated.length_mm, calibrated.uncertainty_mm))
        }
        _ => None,
    };
    (Quantity::SphereSpacing, test.mpe_spacing_mm, positions.iter().enumerate().filter_map(deviation).collect())
}

fn of_plate(test: &PlateTest, positions: &[Position]) -> [Planned; 2] {
    let form = |width: fn(&Plate) -> f64| -> Vec<PositionError> {
        let plates = plates(positions, Procedure::Plate);
        plates.map(|(idx, plate)| error(idx, width(plate), Some(of_form_mm(test.form_mm)))).collect()
    };
    [
        (Quantity::Flatness, test.mpe_flatness_mm, form(|plate| plate.dispersion.range_mm)),
        (Quantity::FlatnessD95, test.mpe_flatness_d95_mm, form(|plate| plate.dispersion.d95_mm)),
    ]
}

fn of_scans(test: &RepeatabilityTest, found: Option<&Repeatability>, last_idx: usize) -> [Planned; 2] {
    let deviation = |of: fn(&Repeatability) -> f64| -> Vec<PositionError> {
        let error = |found: &Repeatability| {
            error(last_idx, of(found), Some(of_standard_deviation(of(found), found.n_scans)))
        };
        found.map(error).into_iter().collect()
    };
    [
        (Quantity::RepeatabilitySingle, test.mpe_single_mm, deviation(|found| found.single_mm)),
        (Quantity::RepeatabilityAveraged, test.mpe_averaged_mm, deviation(|found| found.averaged_mm)),
    ]
}

fn error(position_idx: usize, error_mm: f64, test_uncertainty_mm: Option<f64>) -> PositionError {
    PositionError { position_idx, error_mm, test_uncertainty_mm }
}

fn missing(plan: &AcceptancePlan, positions: &[Position]) -> Vec<MissingPositions> {
    let counted = plan.procedures().map(|procedure| {
        let n_present = positions.iter().filter(|position| position.procedure == procedure).count();
        MissingPositions { procedure, n_present, n_needed: procedure.n_needed() }
    });
    counted.filter(|missing| missing.n_present < missing.n_needed).collect()
}

/// A quantity with its verdict: the worst of its positions.
fn judged(
    quantity: Quantity,
    mpe_mm: Option<f64>,
    errors: Vec<PositionError>,
    is_complete: bool,
) -> QuantityResult {
    let limits = |mpe_mm: f64| match quantity.is_signed() {
        true => Limits::symmetric(mpe_mm),
        false => Limits { lower: None, upper: Some(mpe_mm) },
    };
    let of_one = |mpe_mm: f64, error: &PositionError| match error.test_uncertainty_mm {
        Some(uncertainty_mm) => verdict(error.error_mm, &limits(mpe_mm), uncertainty_mm).into(),
        None => PartVerdict::Undecided,
    };
    let worst = |mpe_mm: f64| {
        // Without an error there is nothing to judge, which is no acceptance.
        errors.iter().map(|error| of_one(mpe_mm, error)).max().unwrap_or(PartVerdict::Invalid)
    };
    let worst_mm = errors.iter().map(|error| error.error_mm).max_by(|a, b| a.abs().total_cmp(&b.abs()));
    QuantityResult { quantity, mpe_mm, worst_mm, verdict: mpe_mm.filter(|_| is_complete).map(worst), errors }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::acceptance::{Dispersion, LinearityTest};

    const DISPERSION: Dispersion = Dispersion { n_points: 2000, n_rejected: 6, range_mm: 0.08, d95_mm: 0.04 };

    fn sphere_test() -> SphereTest {
        SphereTest {
            artefact: "ball 7".to_owned(),
            diameter_mm: 30.0,
            uncertainty_mm: 0.001,
            form_mm: 0.002,
            expansion_per_k: 10e-6,
            mpe_form_mm: Some(0.1),
            mpe_form_d95_mm: None,
            mpe_size_mm: Some(0.03),
        }
    }

    fn ball(diameter_mm: f64, range_mm: f64) -> Position {
        Position {
            procedure: Procedure::Sphere,
            temperature_c: Some(20.0),
            reference_mm: None,
            difference_mm: None,
            figures: Figures::Ball(Ball {
                centre_mm: [0.0, 0.0, 400.0],
                diameter_mm,
                dispersion: Dispersion { range_mm, ..DISPERSION },
                n_excluded: 0,
                per_order: Vec::new(),
            }),
        }
    }

    fn plate(procedure: Procedure, height_mm: f64) -> Position {
        Position {
            procedure,
            temperature_c: None,
            reference_mm: Some(height_mm),
            difference_mm: None,
            figures: Figures::Plate(Plate {
                point_mm: [0.0, 0.0, 400.0 - height_mm],
                normal: [0.0, 0.0, -1.0],
                dispersion: DISPERSION,
                n_excluded: 0,
                per_order: Vec::new(),
            }),
        }
    }

    fn of(result: &AcceptanceResult, quantity: Quantity) -> QuantityResult {
        result.quantities.iter().find(|found| found.quantity == quantity).unwrap().clone()
    }

    #[test]
    fn a_verdict_needs_ten_positions_and_is_that_of_the_worst() {
        let plan = AcceptancePlan { sphere: Some(sphere_test()), ..AcceptancePlan::default() };
        let mut positions = vec![ball(30.01, 0.05); 9];
        let early = evaluate(&plan, &positions);
        let missing = MissingPositions { procedure: Procedure::Sphere, n_present: 9, n_needed: 10 };
        assert_eq!((early.verdict, early.missing), (None, vec![missing]));
        // (error of size, range, verdict): U of the size is 1 µm and 0.15 µm of the thermometer, that of the form 2 µm.
        let cases = [
            (0.010, 0.050, PartVerdict::Ok),
            (0.0295, 0.050, PartVerdict::Undecided),
            (-0.040, 0.050, PartVerdict::NotOk),
            (0.010, 0.099, PartVerdict::Undecided),
            (0.010, 0.103, PartVerdict::NotOk),
        ];
        for (size_mm, range_mm, expected) in cases {
            positions.truncate(9);
            positions.push(ball(30.0 + size_mm, range_mm));
            let result = evaluate(&plan, &positions);
            assert_eq!(result.verdict, Some(expected), "{size_mm} {range_mm}");
            // No limit, no verdict; the figure is stated.
            let d95 = of(&result, Quantity::ProbingFormD95);
            assert_eq!((d95.verdict, d95.worst_mm), (None, Some(0.04)));
        }
        let worst = of(&evaluate(&plan, &positions), Quantity::ProbingForm).worst_mm.unwrap();
        assert!((worst - 0.103).abs() < 1e-12);
    }

    #[test]
    fn a_size_at_an_unknown_temperature_is_undecided_and_a_form_is_not() {
        let plan = AcceptancePlan { sphere: Some(sphere_test()), ..AcceptancePlan::default() };
        let mut positions = vec![ball(30.0, 0.05); 10];
        positions[4].temperature_c = None;
        let result = evaluate(&plan, &positions);
        assert_eq!(of(&result, Quantity::ProbingSize).verdict, Some(PartVerdict::Undecided));
        assert_eq!(of(&result, Quantity::ProbingForm).verdict, Some(PartVerdict::Ok));
    }

    #[test]
    fn a_warm_ball_is_compared_with_its_diameter_at_that_temperature() {
        let plan = AcceptancePlan { sphere: Some(sphere_test()), ..AcceptancePlan::default() };
        let mut positions = vec![ball(30.0, 0.05); 10];
        positions.iter_mut().for_each(|position| position.temperature_c = Some(30.0));
        let size = of(&evaluate(&plan, &positions), Quantity::ProbingSize);
        assert!((size.worst_mm.unwrap() + 0.003).abs() < 1e-12, "{size:?}");
    }

    #[test]
    fn linearity_and_repeatability_have_a_verdict_of_their_own() {
        let plan = AcceptancePlan {
            linearity: Some(LinearityTest {
                artefact: "gauge blocks".to_owned(),
                uncertainty_mm: 0.0005,
                mpe_linearity_mm: Some(0.01),
            }),
            repeatability: Some(RepeatabilityTest {
                artefact: "plate".to_owned(),
                mpe_single_mm: Some(0.02),
                mpe_averaged_mm: Some(0.0001),
            }),
            ..AcceptancePlan::default()
        };
        let mut positions: Vec<Position> =
            (0..5).map(|idx| plate(Procedure::Linearity, 10.0 * f64::from(idx))).collect();
        positions.extend((0..10).map(|idx| Position {
            difference_mm: (idx > 0).then_some(0.005),
            ..plate(Procedure::Repeatability, 0.001 * f64::from(idx % 2))
        }));
        let result = evaluate(&plan, &positions);
        assert_eq!(of(&result, Quantity::Linearity).verdict, Some(PartVerdict::Ok));
        assert_eq!(of(&result, Quantity::RepeatabilitySingle).verdict, Some(PartVerdict::Ok));
        // 0.53 µm ± 0.25 µm against 0.1 µm.
        assert_eq!(of(&result, Quantity::RepeatabilityAveraged).verdict, Some(PartVerdict::NotOk));
        assert_eq!((result.verdict, result.missing), (Some(PartVerdict::NotOk), Vec::new()));
        // Without references there is no line, which is no acceptance.
        positions.iter_mut().for_each(|position| position.reference_mm = None);
        let without = evaluate(&plan, &positions);
        assert_eq!(of(&without, Quantity::Linearity).verdict, Some(PartVerdict::Invalid));
    }
}
