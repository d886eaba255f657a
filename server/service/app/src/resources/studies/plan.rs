//! What a study examines.

use capability::params::MIN_TYPE_1_VALUES;
use capability::type_1::Factors;
use metrology::acceptance::{AcceptancePlan, PlanFault};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::error::{AppError, ErrorKind};
use crate::resources::labels::label;

/// Most parts of a gauge R&R study.
const PARTS_LIMIT: usize = 50;

/// Most operators of it.
const OPERATORS_LIMIT: usize = 20;

/// Most repetitions of a part.
const REPETITIONS_LIMIT: u32 = 500;

/// The plan of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StudyPlan {
    /// Errors of the station on calibrated artefacts.
    Acceptance(Box<AcceptancePlan>),
    /// Repeated inspections of a part with a known value.
    #[serde(rename = "type_1")]
    Type1(Type1Plan),
    /// Repeated inspections of several parts by several operators.
    GaugeRr(GaugeRrPlan),
}

/// A type-1 study: one part with a known value, inspected repeatedly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Type1Plan {
    /// Id of the recipe.
    pub recipe: String,
    /// Its version; default: the newest. Inspections with other versions do not belong to the study.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub version: Option<i64>,
    /// Id of the characteristic in the recipe; it needs both limits.
    pub characteristic: String,
    /// Serial number of the part.
    #[schema(max_length = 100)]
    pub serial: String,
    /// Value of the part from its certificate, in the unit of the characteristic.
    pub reference: f64,
    /// Number of inspections.
    #[schema(minimum = 50, maximum = 500)]
    pub n_values: u32,
    /// Standard deviations that count as scatter: 6 (Bosch Booklet 10) or 4 (VDA 5).
    #[schema(minimum = 4, maximum = 6)]
    pub n_sigmas: u8,
}

/// A gauge R&R study: several parts, each inspected repeatedly by every operator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct GaugeRrPlan {
    /// Id of the recipe.
    pub recipe: String,
    /// Its version; default: the newest. Inspections with other versions do not belong to the study.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub version: Option<i64>,
    /// Id of the characteristic in the recipe.
    pub characteristic: String,
    /// Serial numbers of the parts.
    #[schema(min_items = 2, max_items = 50)]
    pub parts: Vec<String>,
    /// Operators, as in the attribute `operator` of the inspections; empty: the station is the only one.
    #[serde(default)]
    #[schema(max_items = 20)]
    pub operators: Vec<String>,
    /// Inspections of each part by each operator.
    #[schema(minimum = 2, maximum = 500)]
    pub n_trials: u32,
}

fn refused(place: &str, detail: impl Into<String>, remedy: impl Into<String>) -> AppError {
    AppError::new(ErrorKind::Impossible, detail).at(place).remedy(remedy)
}

impl StudyPlan {
    /// Checks it.
    ///
    /// # Errors
    /// The first impossible part, with its place and remedy.
    pub fn check(&self) -> Result<(), AppError> {
        match self {
            Self::Acceptance(plan) => check_acceptance(plan),
            Self::Type1(plan) => plan.check(),
            Self::GaugeRr(plan) => plan.check(),
        }
    }

    /// Recipe, its version and the characteristic of a study of inspections.
    pub fn characteristic(&self) -> Option<(&str, Option<i64>, &str)> {
        match self {
            Self::Acceptance(_) => None,
            Self::Type1(plan) => Some((&plan.recipe, plan.version, &plan.characteristic)),
            Self::GaugeRr(plan) => Some((&plan.recipe, plan.version, &plan.characteristic)),
        }
    }

    /// The same plan for a version of its recipe.
    pub(crate) fn with_version(mut self, version: i64) -> Self {
        match &mut self {
            Self::Acceptance(_) => {}
            Self::Type1(plan) => plan.version = Some(version),
            Self::GaugeRr(plan) => plan.version = Some(version),
        }
        self
    }
}

fn check_acceptance(plan: &AcceptancePlan) -> Result<(), AppError> {
    plan.check().map_err(|fault| {
        let (place, remedy) = match &fault {
            PlanFault::Empty => ("/acceptance".to_owned(), "add a procedure"),
            PlanFault::NoLimit { procedure } => {
                (format!("/acceptance/{}", procedure.name()), "give one of its limits (mpe)")
            }
            PlanFault::BadNumber { procedure, field, .. } => {
                (format!("/acceptance/{}/{field}", procedure.name()), "give a number above 0")
            }
        };
        refused(&place, fault.to_string(), remedy)
    })?;
    for (place, artefact) in [
        ("sphere", plan.sphere.as_ref().map(|test| &test.artefact)),
        ("sphere_pair", plan.sphere_pair.as_ref().map(|test| &test.artefact)),
        ("plate", plan.plate.as_ref().map(|test| &test.artefact)),
        ("linearity", plan.linearity.as_ref().map(|test| &test.artefact)),
        ("repeatability", plan.repeatability.as_ref().map(|test| &test.artefact)),
    ] {
        if let Some(artefact) = artefact {
            label(artefact, &format!("/acceptance/{place}/artefact"))?;
        }
    }
    Ok(())
}

impl Type1Plan {
    /// The variant of the indices.
    pub fn factors(&self) -> Factors {
        if self.n_sigmas == 4 { Factors::FOUR_SIGMA } else { Factors::SIX_SIGMA }
    }

    fn check(&self) -> Result<(), AppError> {
        label(&self.serial, "/type_1/serial")?;
        if !self.reference.is_finite() {
            return Err(refused(
                "/type_1/reference",
                "the reference value is no number",
                "give its certified value",
            ));
        }
        if !matches!(self.n_sigmas, 4 | 6) {
            let detail = format!("{} standard deviations are not a variant of the study", self.n_sigmas);
            return Err(refused("/type_1/n_sigmas", detail, "give 6 or 4"));
        }
        if (self.n_values as usize) < MIN_TYPE_1_VALUES || self.n_values > REPETITIONS_LIMIT {
            let detail = format!("a type-1 study of {} values is not possible", self.n_values);
            let remedy = format!("give {MIN_TYPE_1_VALUES} to {REPETITIONS_LIMIT}");
            return Err(refused("/type_1/n_values", detail, remedy));
        }
        Ok(())
    }
}

impl GaugeRrPlan {
    fn check(&self) -> Result<(), AppError> {
        if self.parts.len() < 2 || self.parts.len() > PARTS_LIMIT || has_twice(&self.parts) {
            let remedy = format!("give 2 to {PARTS_LIMIT} different serial numbers");
            return Err(refused("/gauge_rr/parts", "these parts are not a study", remedy));
        }
        if self.operators.len() > OPERATORS_LIMIT || has_twice(&self.operators) {
            let remedy = format!("give up to {OPERATORS_LIMIT} different names");
            return Err(refused("/gauge_rr/operators", "these operators are not a study", remedy));
        }
        if self.n_trials < 2 || self.n_trials > REPETITIONS_LIMIT {
            let detail = format!("{} inspections of each part are not a study", self.n_trials);
            return Err(refused("/gauge_rr/n_trials", detail, format!("give 2 to {REPETITIONS_LIMIT}")));
        }
        self.parts.iter().try_for_each(|part| label(part, "/gauge_rr/parts"))?;
        self.operators.iter().try_for_each(|operator| label(operator, "/gauge_rr/operators"))
    }
}

fn has_twice(names: &[String]) -> bool {
    names.iter().enumerate().any(|(idx, name)| names[..idx].contains(name))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn type_1() -> Type1Plan {
        Type1Plan {
            recipe: "bracket".to_owned(),
            version: None,
            characteristic: "height".to_owned(),
            serial: "REF".to_owned(),
            reference: 8.9,
            n_values: 50,
            n_sigmas: 6,
        }
    }

    fn gauge_rr() -> GaugeRrPlan {
        GaugeRrPlan {
            recipe: "bracket".to_owned(),
            version: None,
            characteristic: "height".to_owned(),
            parts: ["A", "B"].map(str::to_owned).to_vec(),
            operators: Vec::new(),
            n_trials: 2,
        }
    }

    #[test]
    fn an_impossible_study_is_refused_with_its_place() {
        let place = |plan: StudyPlan| plan.check().err().and_then(|error| error.pointer);
        assert_eq!(place(StudyPlan::Type1(type_1())), None);
        assert_eq!(place(StudyPlan::GaugeRr(gauge_rr())), None);
        let cases = [
            (StudyPlan::Acceptance(Box::default()), "/acceptance"),
            (StudyPlan::Type1(Type1Plan { n_values: 49, ..type_1() }), "/type_1/n_values"),
            (StudyPlan::Type1(Type1Plan { n_sigmas: 5, ..type_1() }), "/type_1/n_sigmas"),
            (StudyPlan::Type1(Type1Plan { reference: f64::NAN, ..type_1() }), "/type_1/reference"),
            (StudyPlan::GaugeRr(GaugeRrPlan { parts: vec!["A".to_owned()], ..gauge_rr() }), "/gauge_rr/parts"),
            (StudyPlan::GaugeRr(GaugeRrPlan { parts: vec!["A".to_owned(); 2], ..gauge_rr() }), "/gauge_rr/parts"),
            (StudyPlan::GaugeRr(GaugeRrPlan { n_trials: 1, ..gauge_rr() }), "/gauge_rr/n_trials"),
        ];
        for (plan, expected) in cases {
            assert_eq!(place(plan.clone()).as_deref(), Some(expected), "{plan:?}");
        }
    }
}
