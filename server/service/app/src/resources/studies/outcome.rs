//! The outcome of a study: figures, what is still missing, verdict.

use capability::gauge_rr::{Acceptance, GaugeRr, acceptance};
use capability::params::MIN_NDC;
use capability::type_1::Study as Type1Study;
use metrology::PartVerdict;
use metrology::acceptance::{AcceptanceResult, MissingPositions, evaluate};
use store::Catalogue;

use crate::error::AppError;
use crate::resources::statistics::Series;
use crate::resources::studies::readings::{Selected, all_since};
use crate::resources::studies::{GaugeRrPlan, Study, StudyPlan, Type1Plan};

/// The outcome of a study so far.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The verdict on the station; `None` while something is missing.
    pub verdict: Option<PartVerdict>,
    /// The figures.
    pub found: Found,
}

/// The figures of a study.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    /// Of an acceptance test.
    Acceptance(AcceptanceResult),
    /// Of a type-1 study.
    Type1 {
        /// What is missing.
        missing: Vec<MissingInspections>,
        /// The inspections; `None`: there are none.
        selected: Option<Selected>,
        /// The figures once nothing is missing; `Err`: why there are none.
        study: Option<Result<Type1Study, String>>,
    },
    /// Of a gauge R&R study.
    GaugeRr {
        /// What is missing.
        missing: Vec<MissingInspections>,
        /// The inspections; `None`: there are none.
        selected: Option<Selected>,
        /// The figures once nothing is missing; `Err`: why there are none.
        study: Option<Result<GaugeRr, String>>,
    },
}

/// Inspections that are still missing of one part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissingInspections {
    /// Serial number of the part.
    pub serial: String,
    /// Operator; `None`: anyone.
    pub operator: Option<String>,
    /// Inspections present.
    pub n_present: usize,
    /// Inspections needed.
    pub n_needed: usize,
}

/// The outcome of a study from its positions or from the inspections so far.
///
/// # Errors
/// The store cannot be read, or a record is damaged.
pub async fn outcome(read: &dyn Catalogue, study: &Study) -> Result<Outcome, AppError> {
    let series = match study.body.plan.characteristic() {
        Some(of) => all_since(read, study, of).await?,
        None => None,
    };
    Ok(outcome_of(study, series))
}

/// The outcome of a study from its positions alone: of an acceptance test, or of any study that was just created.
pub fn outcome_without_inspections(study: &Study) -> Outcome {
    outcome_of(study, None)
}

fn outcome_of(study: &Study, series: Option<Series>) -> Outcome {
    match &study.body.plan {
        StudyPlan::Acceptance(plan) => {
            let result = evaluate(plan, &study.positions());
            Outcome { verdict: result.verdict, found: Found::Acceptance(result) }
        }
        StudyPlan::Type1(plan) => of_type_1(plan, series.map(|series| plan.select(series))),
        StudyPlan::GaugeRr(plan) => of_gauge_rr(plan, series.map(|series| plan.select(series))),
    }
}

impl Outcome {
    /// Positions that are still missing.
    pub fn missing_positions(&self) -> &[MissingPositions] {
        match &self.found {
            Found::Acceptance(result) => &result.missing,
            Found::Type1 { .. } | Found::GaugeRr { .. } => &[],
        }
    }

    /// Inspections that are still missing.
    pub fn missing_inspections(&self) -> &[MissingInspections] {
        match &self.found {
            Found::Acceptance(_) => &[],
            Found::Type1 { missing, .. } | Found::GaugeRr { missing, .. } => missing,
        }
    }
}

fn of_type_1(plan: &Type1Plan, selected: Option<Selected>) -> Outcome {
    let none = || vec![(plan.serial.clone(), None, 0)];
    let cells = selected.as_ref().map_or_else(none, |selected| selected.cells.clone());
    let missing = missing(cells, plan.n_values as usize);
    let study = selected.as_ref().filter(|_| missing.is_empty()).map(|selected| plan.evaluate(selected));
    let verdict = study.as_ref().map(|study| match study.as_ref().map(|study| study.verdict) {
        Ok(capability::Verdict::Capable) => PartVerdict::Ok,
        Ok(capability::Verdict::NotCapable) => PartVerdict::NotOk,
        Ok(capability::Verdict::Undecided) => PartVerdict::Undecided,
        Err(_) => PartVerdict::Invalid,
    });
    Outcome { verdict, found: Found::Type1 { missing, selected, study } }
}

fn of_gauge_rr(plan: &GaugeRrPlan, selected: Option<Selected>) -> Outcome {
    let cells = selected.as_ref().map(|selected| selected.cells.clone());
    let missing = missing(cells.unwrap_or_else(|| plan.no_cells()), plan.n_trials as usize);
    let study = selected.as_ref().filter(|_| missing.is_empty()).map(|selected| plan.evaluate(selected));
    let verdict = study.as_ref().map(|study| study.as_ref().map_or(PartVerdict::Invalid, verdict_of));
    Outcome { verdict, found: Found::GaugeRr { missing, selected, study } }
}

/// The verdict by AIAG: %GRR up to 10 % is acceptable, up to 30 % conditionally, and there are at least five categories.
/// %GRR is that of the tolerance, or of the total variation without two limits.
fn verdict_of(study: &GaugeRr) -> PartVerdict {
    let percent = study.gauge_rr.percent_of_tolerance.unwrap_or(study.gauge_rr.percent_of_total);
    let by_percent = match acceptance(percent) {
        Acceptance::Acceptable => PartVerdict::Ok,
        Acceptance::Conditional => PartVerdict::Undecided,
        Acceptance::Unacceptable => PartVerdict::NotOk,
    };
    let by_categories =
        if study.ndc.is_none_or(|ndc| ndc >= MIN_NDC) { PartVerdict::Ok } else { PartVerdict::NotOk };
    by_percent.max(by_categories)
}

fn missing(cells: Vec<(String, Option<String>, usize)>, n_needed: usize) -> Vec<MissingInspections> {
    let cells = cells.into_iter().filter(|(_, _, n_present)| *n_present < n_needed);
    cells
        .map(|(serial, operator, n_present)| MissingInspections { serial, operator, n_present, n_needed })
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use capability::spc::SpecificationLimits;

    use super::*;
    use crate::resources::statistics::SeriesReading;
    use crate::resources::studies::StudyBody;

    fn series(values: &[(&str, Option<&str>, f64)]) -> Series {
        let reading = |(seq, (serial, operator, value)): (i64, &(&str, Option<&str>, f64))| SeriesReading {
            seq,
            inspection_id: seq.to_string(),
            serial: (*serial).to_owned(),
            operator: operator.map(str::to_owned),
            at_ms: seq,
            value: Some(*value),
        };
        Series {
            unit: "mm".to_owned(),
            nominal: Some(10.0),
            limits: SpecificationLimits { lower: Some(9.0), upper: Some(11.0) },
            readings: (1..).zip(values).map(reading).collect(),
        }
    }

    fn study(plan: StudyPlan) -> Study {
        let body = StudyBody { name: "msa".to_owned(), author: "Anna".to_owned(), plan, positions: Vec::new() };
        Study { id: "s".to_owned(), version: 1, body, created_at_ms: 0, changed_at_ms: 0 }
    }

    fn gauge_rr(operators: &[&str]) -> GaugeRrPlan {
        GaugeRrPlan {
            recipe: "bracket".to_owned(),
            version: Some(1),
            characteristic: "height".to_owned(),
            parts: ["A", "B", "C"].map(str::to_owned).to_vec(),
            operators: operators.iter().map(|name| (*name).to_owned()).collect(),
            n_trials: 2,
        }
    }

    #[test]
    fn a_type_1_study_takes_the_first_values_of_its_part() {
        let plan = Type1Plan {
            recipe: "bracket".to_owned(),
            version: Some(1),
            characteristic: "height".to_owned(),
            serial: "REF".to_owned(),
            reference: 10.002,
            n_values: 50,
            n_sigmas: 6,
        };
        let mut values: Vec<_> = (0..49).map(|idx| ("REF", None, 10.0 + 0.001 * f64::from(idx % 5))).collect();
        values.push(("OTHER", None, 10.0));
        let study = study(StudyPlan::Type1(plan));
        let early = outcome_of(&study, Some(series(&values)));
        let missing = MissingInspections { serial: "REF".to_owned(), operator: None, n_present: 49, n_needed: 50 };
        assert_eq!((early.verdict, early.missing_inspections()), (None, &[missing][..]));
        // The fiftieth completes it, and later ones do not count, good or bad.
        values.extend([("REF", None, 10.004), ("REF", None, 90.0)]);
        let done = outcome_of(&study, Some(series(&values)));
        assert_eq!((done.verdict, done.missing_inspections()), (Some(PartVerdict::Ok), &[][..]));
        assert_eq!(outcome_without_inspections(&study).missing_inspections()[0].n_present, 0);
    }

    #[test]
    fn a_gauge_rr_study_names_the_part_and_the_operator_that_are_missing() {
        let value = |part: usize, trial: usize| 9.5 + 0.5 * part as f64 + 0.002 * trial as f64;
        let names = ["A", "B", "C"];
        let all = |operators: &[&'static str]| -> Vec<(&str, Option<&str>, f64)> {
            let cells = operators.iter().flat_map(|operator| (0..3).map(move |part| (*operator, part)));
            cells
                .flat_map(|(op, part)| (0..2).map(move |trial| (names[part], Some(op), value(part, trial))))
                .collect()
        };
        let crossed = study(StudyPlan::GaugeRr(gauge_rr(&["Anna", "Ben"])));
        let mut values = all(&["Anna", "Ben"]);
        let last = values.pop().unwrap();
        let early = outcome_of(&crossed, Some(series(&values)));
        let [missing] = early.missing_inspections() else { panic!("{early:?}") };
        assert_eq!((missing.serial.as_str(), missing.operator.as_deref()), ("C", Some("Ben")));
        assert_eq!((missing.n_present, missing.n_needed, early.verdict), (1, 2, None));
        // An inspection by someone else does not help.
        values.push(("C", Some("Carl"), 10.5));
        assert_eq!(outcome_of(&crossed, Some(series(&values))).verdict, None);
        values.push(last);
        assert_eq!(outcome_of(&crossed, Some(series(&values))).verdict, Some(PartVerdict::Ok));
        // Without operators anyone's inspections belong to it.
        let automatic = study(StudyPlan::GaugeRr(gauge_rr(&[])));
        let Found::GaugeRr { study: Some(Ok(found)), .. } = outcome_of(&automatic, Some(series(&values))).found
        else {
            panic!("no figures")
        };
        assert_eq!((found.n_operators, found.n_parts, found.n_trials), (1, 3, 2));
    }

    #[test]
    fn scatter_of_a_third_of_the_tolerance_is_not_ok() {
        // s of about 0.14 mm on a tolerance of 2 mm: 6 s are 42 %.
        let values: Vec<_> = ["A", "B", "C"]
            .iter()
            .zip([9.0, 10.0, 11.0])
            .flat_map(|(part, at)| [(*part, None, at + 0.1), (*part, None, at - 0.1)])
            .collect();
        let study = study(StudyPlan::GaugeRr(gauge_rr(&[])));
        assert_eq!(outcome_of(&study, Some(series(&values))).verdict, Some(PartVerdict::NotOk));
    }
}
