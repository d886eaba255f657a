//! What is tested: artefacts with their calibrated values, and the limits.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::params::EXPANSION_PER_K;

/// A procedure of an acceptance test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Procedure {
    /// A ball at many positions: probing error of form and size.
    Sphere,
    /// Two balls at a calibrated distance: sphere spacing error.
    SpherePair,
    /// A flat plate at many positions: flatness error.
    Plate,
    /// A plate at known heights: linearity along z.
    Linearity,
    /// A plate that is scanned repeatedly without being moved: repeatability along z.
    Repeatability,
}

impl Procedure {
    /// All procedures, in the order of a report.
    pub const ALL: [Self; 5] = [Self::Sphere, Self::SpherePair, Self::Plate, Self::Linearity, Self::Repeatability];

    /// Its name in records and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::SpherePair => "sphere_pair",
            Self::Plate => "plate",
            Self::Linearity => "linearity",
            Self::Repeatability => "repeatability",
        }
    }

    /// Positions (or scans) needed: ten of a ball, seven of a pair and six of a plate by VDI/VDE 2634; five heights leave a
    /// straight line three degrees of freedom, and ten repetitions determine a standard deviation within a quarter.
    pub fn n_needed(self) -> usize {
        match self {
            Self::Sphere | Self::Repeatability => 10,
            Self::SpherePair => 7,
            Self::Plate => 6,
            Self::Linearity => 5,
        }
    }
}

fn steel_per_k() -> f64 {
    EXPANSION_PER_K
}

/// A calibrated ball. Lengths in mm at 20 °C; uncertainties are expanded (k = 2).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereTest {
    /// Name of the artefact and its certificate.
    pub artefact: String,
    /// Calibrated diameter.
    pub diameter_mm: f64,
    /// Its uncertainty.
    pub uncertainty_mm: f64,
    /// Calibrated form error.
    pub form_mm: f64,
    /// Coefficient of thermal expansion; default: steel.
    #[serde(default = "steel_per_k")]
    pub expansion_per_k: f64,
    /// Largest probing error of form, all points but 3 ‰.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mpe_form_mm: Option<f64>,
    /// Largest probing error of form, 95 % of the points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mpe_form_d95_mm: Option<f64>,
    /// Largest probing error of size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mpe_size_mm: Option<f64>,
}

/// Two balls at a calibrated distance. Lengths in mm at 20 °C; uncertainties are expanded (k = 2).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpherePairTest {
    /// Name of the artefact and its certificate.
    pub artefact: String,
    /// Calibrated distance of the centres.
    pub distance_mm: f64,
    /// Its uncertainty.
    pub uncertainty_mm: f64,
    /// Diameter of the balls; needed to find them.
    pub diameter_mm: f64,
    /// Coefficient of thermal expansion of the bar; default: steel.
    #[serde(default = "steel_per_k")]
    pub expansion_per_k: f64,
    /// Largest sphere spacing error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mpe_spacing_mm: Option<f64>,
}

/// A flat plate. Lengths in mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlateTest {
    /// Name of the artefact and its certificate.
    pub artefact: String,
    /// Calibrated flatness.
    pub form_mm: f64,
    /// Largest flatness error, all points but 3 ‰.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mpe_flatness_mm: Option<f64>,
    /// Largest flatness error, 95 % of the points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mpe_flatness_d95_mm: Option<f64>,
}

/// A plate at known heights. Uncertainties are expanded (k = 2).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinearityTest {
    /// What sets the heights, and its certificate.
    pub artefact: String,
    /// Uncertainty of a height, mm.
    pub uncertainty_mm: f64,
    /// Largest deviation from the least-squares line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mpe_linearity_mm: Option<f64>,
}

/// A plate that is scanned repeatedly without being moved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RepeatabilityTest {
    /// Name of the plate.
    pub artefact: String,
    /// Largest standard deviation of a single point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mpe_single_mm: Option<f64>,
    /// Largest standard deviation of the mean height.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mpe_averaged_mm: Option<f64>,
}

/// An acceptance test: at least one procedure.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AcceptancePlan {
    /// A ball.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sphere: Option<SphereTest>,
    /// Two balls.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sphere_pair: Option<SpherePairTest>,
    /// A plate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plate: Option<PlateTest>,
    /// A plate at known heights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub linearity: Option<LinearityTest>,
    /// A plate that stays in place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeatability: Option<RepeatabilityTest>,
}

/// What is wrong with a plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanFault {
    /// Nothing is tested.
    #[error("the acceptance test has no procedure")]
    Empty,
    /// A procedure without a limit has no verdict.
    #[error("the procedure {} has no limit", procedure.name())]
    NoLimit {
        /// Which.
        procedure: Procedure,
    },
    /// A number that is not positive and finite.
    #[error("{field} of {} is {value}", procedure.name())]
    BadNumber {
        /// Which procedure.
        procedure: Procedure,
        /// Its field.
        field: &'static str,
        /// The value.
        value: f64,
    },
}

impl AcceptancePlan {
    /// Its procedures, in the order of a report.
    pub fn procedures(&self) -> impl Iterator<Item = Procedure> {
        let planned = [
            self.sphere.is_some(),
            self.sphere_pair.is_some(),
            self.plate.is_some(),
            self.linearity.is_some(),
            self.repeatability.is_some(),
        ];
        Procedure::ALL
            .into_iter()
            .zip(planned)
            .filter_map(|(procedure, is_planned)| is_planned.then_some(procedure))
    }

    /// The JSON schema of the document.
    pub fn schema() -> serde_json::Value {
        schemars::schema_for!(Self).to_value()
    }

    /// Checks that there is a procedure, that each has a limit, and that all numbers are usable.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self) -> Result<(), PlanFault> {
        if self.procedures().next().is_none() {
            return Err(PlanFault::Empty);
        }
        for procedure in self.procedures() {
            let (sizes, uncertainties, limits) = self.numbers(procedure);
            let is_size = |value: f64| value.is_finite() && value > 0.0;
            let is_uncertainty = |value: f64| value.is_finite() && value >= 0.0;
            let limits: Vec<(&'static str, f64)> =
                limits.into_iter().filter_map(|(field, limit)| Some((field, limit?))).collect();
            let bad_size = sizes.iter().chain(&limits).find(|(_, value)| !is_size(*value));
            let bad = bad_size.or_else(|| uncertainties.iter().find(|(_, value)| !is_uncertainty(*value)));
            if let Some(&(field, value)) = bad {
                return Err(PlanFault::BadNumber { procedure, field, value });
            }
            if limits.is_empty() {
                return Err(PlanFault::NoLimit { procedure });
            }
        }
        Ok(())
    }

    /// Sizes, which are above 0; uncertainties and form errors, which may be 0; limits.
    #[expect(clippy::type_complexity, reason = "three short lists of named numbers")]
    fn numbers(
        &self,
        procedure: Procedure,
    ) -> (Vec<(&'static str, f64)>, Vec<(&'static str, f64)>, Vec<(&'static str, Option<f64>)>) {
        let nothing = || (Vec::new(), Vec::new(), Vec::new());
        match procedure {
            Procedure::Sphere => self.sphere.as_ref().map_or_else(nothing, |test| {
                (
                    vec![("diameter_mm", test.diameter_mm)],
                    vec![
                        ("uncertainty_mm", test.uncertainty_mm),
                        ("form_mm", test.form_mm),
                        ("expansion_per_k", test.expansion_per_k),
                    ],
                    vec![
                        ("mpe_form_mm", test.mpe_form_mm),
                        ("mpe_form_d95_mm", test.mpe_form_d95_mm),
                        ("mpe_size_mm", test.mpe_size_mm),
                    ],
                )
            }),
            Procedure::SpherePair => self.sphere_pair.as_ref().map_or_else(nothing, |test| {
                (
                    vec![("distance_mm", test.distance_mm), ("diameter_mm", test.diameter_mm)],
                    vec![("uncertainty_mm", test.uncertainty_mm), ("expansion_per_k", test.expansion_per_k)],
                    vec![("mpe_spacing_mm", test.mpe_spacing_mm)],
                )
            }),
            Procedure::Plate => self.plate.as_ref().map_or_else(nothing, |test| {
                (
                    Vec::new(),
                    vec![("form_mm", test.form_mm)],
                    vec![
                        ("mpe_flatness_mm", test.mpe_flatness_mm),
                        ("mpe_flatness_d95_mm", test.mpe_flatness_d95_mm),
                    ],
                )
            }),
            Procedure::Linearity => self.linearity.as_ref().map_or_else(nothing, |test| {
                (
                    Vec::new(),
                    vec![("uncertainty_mm", test.uncertainty_mm)],
                    vec![("mpe_linearity_mm", test.mpe_linearity_mm)],
                )
            }),
            Procedure::Repeatability => self.repeatability.as_ref().map_or_else(nothing, |test| {
                (
                    Vec::new(),
                    Vec::new(),
                    vec![("mpe_single_mm", test.mpe_single_mm), ("mpe_averaged_mm", test.mpe_averaged_mm)],
                )
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball() -> SphereTest {
        SphereTest {
            artefact: "ball 7".to_owned(),
            diameter_mm: 30.0,
            uncertainty_mm: 0.0006,
            form_mm: 0.0003,
            expansion_per_k: EXPANSION_PER_K,
            mpe_form_mm: Some(0.05),
            mpe_form_d95_mm: None,
            mpe_size_mm: None,
        }
    }

    #[test]
    fn a_plan_has_a_procedure_with_a_limit_and_usable_numbers() {
        let plan = |sphere| AcceptancePlan { sphere: Some(sphere), ..AcceptancePlan::default() };
        assert_eq!(plan(ball()).check(), Ok(()));
        assert_eq!(plan(SphereTest { form_mm: 0.0, ..ball() }).check(), Ok(()));
        assert_eq!(AcceptancePlan::default().check(), Err(PlanFault::Empty));
        let bare = SphereTest { mpe_form_mm: None, ..ball() };
        assert_eq!(plan(bare).check(), Err(PlanFault::NoLimit { procedure: Procedure::Sphere }));
        let cases: [(SphereTest, &str); 3] = [
            (SphereTest { diameter_mm: 0.0, ..ball() }, "diameter_mm"),
            (SphereTest { uncertainty_mm: -0.1, ..ball() }, "uncertainty_mm"),
            (SphereTest { mpe_size_mm: Some(f64::NAN), ..ball() }, "mpe_size_mm"),
        ];
        for (sphere, expected) in cases {
            let fault = plan(sphere).check();
            assert!(matches!(fault, Err(PlanFault::BadNumber { field, .. }) if field == expected), "{fault:?}");
        }
    }
}
