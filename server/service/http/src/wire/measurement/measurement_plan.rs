//! The measurement plan on the wire.

use metrology::Tool;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::measurement::measurements::{MeasureDto, ToolDto};
use app::error::{AppError, ErrorKind};
use app::measurements::MeasureInput;
use app::measurements::plan::{MeasurementPlan, PlannedRange};

/// What *Start* scans and measures, the same in every browser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "from_mm": -20, "to_mm": 20, "step_mm": 0.2,
    "measure": [{ "tool": "sphere", "nominal_mm": 18.9, "tolerance_mm": 0.05 }]
}))]
pub struct MeasurementPlanDto {
    /// First position of a linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Last position of a linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
    /// Distance between rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0)]
    pub step_mm: Option<f64>,
    /// First angle of a turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// Last angle of a turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
    /// Angle between rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0)]
    pub step_deg: Option<f64>,
    /// Exposure time of the frames; default: chosen by the station.
    #[schema(exclusive_minimum = 0.0)]
    pub exposure_us: Option<f64>,
    /// What is measured on every part; empty: scan only.
    #[serde(default)]
    #[schema(max_items = 50)]
    pub measure: Vec<MeasureDto>,
}

impl From<MeasurementPlan> for MeasurementPlanDto {
    fn from(plan: MeasurementPlan) -> Self {
        let MeasurementPlan { range, exposure_us, measure } = plan;
        let measure = measure.into_iter().filter_map(dto_of).collect();
        let open = Self {
            from_mm: None,
            to_mm: None,
            step_mm: None,
            from_deg: None,
            to_deg: None,
            step_deg: None,
            exposure_us,
            measure,
        };
        match range {
            PlannedRange::Linear { from_mm, to_mm, step_mm } => {
                Self { from_mm: Some(from_mm), to_mm: Some(to_mm), step_mm: Some(step_mm), ..open }
            }
            PlannedRange::Rotary { from_deg, to_deg, step_deg } => {
                Self { from_deg: Some(from_deg), to_deg: Some(to_deg), step_deg: Some(step_deg), ..open }
            }
        }
    }
}

/// `None` for an unknown tool; such a plan is refused.
fn dto_of(input: MeasureInput) -> Option<MeasureDto> {
    let MeasureInput { tool, name, nominal_mm, tolerance_mm, region_mm, seed } = input;
    let tool = ToolDto::from(Tool::from_name(&tool)?);
    Some(MeasureDto { tool, name, nominal_mm, tolerance_mm, region_mm, seed })
}

impl TryFrom<MeasurementPlanDto> for MeasurementPlan {
    type Error = AppError;

    fn try_from(dto: MeasurementPlanDto) -> Result<Self, AppError> {
        let travel = [("from_mm", dto.from_mm), ("to_mm", dto.to_mm), ("step_mm", dto.step_mm)];
        let turn = [("from_deg", dto.from_deg), ("to_deg", dto.to_deg), ("step_deg", dto.step_deg)];
        let given = |range: &[(&str, Option<f64>)]| range.iter().any(|(_, value)| value.is_some());
        let range = if given(&turn) {
            if let Some((field, _)) = travel.iter().find(|(_, value)| value.is_some()) {
                return Err(refused(field, "must not be combined with angles", "give the range in one unit"));
            }
            let [from_deg, to_deg, step_deg] = whole(turn)?;
            PlannedRange::Rotary { from_deg, to_deg, step_deg }
        } else {
            let [from_mm, to_mm, step_mm] = whole(travel)?;
            PlannedRange::Linear { from_mm, to_mm, step_mm }
        };
        let measure = dto.measure.into_iter().map(MeasureInput::from).collect();
        Ok(Self { range, exposure_us: dto.exposure_us, measure })
    }
}

/// The values, all of which are required.
fn whole<const N: usize>(fields: [(&str, Option<f64>); N]) -> Result<[f64; N], AppError> {
    if let Some((field, _)) = fields.iter().find(|(_, value)| value.is_none()) {
        return Err(refused(field, "is missing", "give it"));
    }
    Ok(fields.map(|(_, value)| value.unwrap_or_default()))
}

fn refused(field: &str, detail: &str, remedy: &str) -> AppError {
    AppError::new(ErrorKind::Impossible, format!("{field} {detail}")).at(format!("/{field}")).remedy(remedy)
}
