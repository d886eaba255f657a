//! Requests about studies.

use app::studies::{GaugeRrPlan, StudyPlan, Type1Plan};
use app::use_cases::NewPosition;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::problem::{Problem, ProblemKind};
use crate::wire::study::acceptance::{AcceptancePlanDto, ProcedureDto};

/// What a study examines: exactly one of the three.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyPlanDto {
    /// An acceptance test: errors of the station on calibrated artefacts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub acceptance: Option<AcceptancePlanDto>,
    /// A type-1 study: one part with a known value, inspected repeatedly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub type_1: Option<Type1Plan>,
    /// A gauge R&R study: several parts, each inspected repeatedly by every operator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub gauge_rr: Option<GaugeRrPlan>,
}

impl TryFrom<StudyPlanDto> for StudyPlan {
    type Error = Problem;

    fn try_from(dto: StudyPlanDto) -> Result<Self, Problem> {
        match dto {
            StudyPlanDto { acceptance: Some(plan), type_1: None, gauge_rr: None } => {
                Ok(Self::Acceptance(Box::new(plan.0)))
            }
            StudyPlanDto { acceptance: None, type_1: Some(plan), gauge_rr: None } => Ok(Self::Type1(plan)),
            StudyPlanDto { acceptance: None, type_1: None, gauge_rr: Some(plan) } => Ok(Self::GaugeRr(plan)),
            _ => Err(Problem::new(ProblemKind::Impossible, "a study examines one thing")
                .at("/plan")
                .remedy("give one of acceptance, type_1 and gauge_rr")),
        }
    }
}

impl From<StudyPlan> for StudyPlanDto {
    fn from(plan: StudyPlan) -> Self {
        let none = Self { acceptance: None, type_1: None, gauge_rr: None };
        match plan {
            StudyPlan::Acceptance(plan) => Self { acceptance: Some(AcceptancePlanDto(*plan)), ..none },
            StudyPlan::Type1(plan) => Self { type_1: Some(plan), ..none },
            StudyPlan::GaugeRr(plan) => Self { gauge_rr: Some(plan), ..none },
        }
    }
}

/// Request to create a study.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "name": "after service",
    "plan": { "acceptance": { "sphere": {
        "artefact": "ball 7, certificate 4711", "diameter_mm": 30.0021, "uncertainty_mm": 0.0006, "form_mm": 0.0003,
        "mpe_form_mm": 0.08, "mpe_size_mm": 0.03
    } } }
}))]
pub struct CreateStudyDto {
    /// Its name.
    #[schema(max_length = 100)]
    pub name: String,
    /// What it examines.
    pub plan: StudyPlanDto,
}

/// Request to add a scan of an artefact to an acceptance test.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "procedure": "sphere", "scan_id": "019a…", "temperature_c": 20.4 }))]
pub struct AddPositionDto {
    /// The procedure that it belongs to.
    pub procedure: ProcedureDto,
    /// The scan: complete, and not a position of this test yet.
    pub scan_id: String,
    /// Temperature of the artefact, °C. A size or a distance is undecided without it.
    #[schema(minimum = 0, maximum = 50)]
    pub temperature_c: Option<f64>,
    /// Linearity: the height at which the plate was placed, mm, positive towards the camera.
    pub reference_mm: Option<f64>,
    /// Only use points in this box of the part frame: x, y, z of one corner, x, y, z of the other.
    #[schema(min_items = 6, max_items = 6)]
    pub region_mm: Option<[f64; 6]>,
}

impl From<AddPositionDto> for NewPosition {
    fn from(dto: AddPositionDto) -> Self {
        let AddPositionDto { procedure, scan_id, temperature_c, reference_mm, region_mm } = dto;
        Self { procedure: procedure.into(), scan_id, temperature_c, reference_mm, region_mm }
    }
}
