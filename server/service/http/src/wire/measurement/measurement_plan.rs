//! The measurement plan on the wire.

use metrology::Tool;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::measurement::measurements::{MeasureDto, ToolDto};
use app::measurements::MeasureInput;
use app::measurements::plan::MeasurementPlan;

/// What is scanned and measured when somebody presses Start, the same in every browser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "from_mm": -20, "to_mm": 20, "step_mm": 0.2,
    "measure": [{ "tool": "sphere", "nominal_mm": 18.9, "tolerance_mm": 0.05 }]
}))]
pub struct MeasurementPlanDto {
    /// First stage position.
    pub from_mm: f64,
    /// Last stage position.
    pub to_mm: f64,
    /// Distance between frames.
    #[schema(exclusive_minimum = 0.0)]
    pub step_mm: f64,
    /// Exposure of the frames; missing: as the station thinks best.
    #[schema(exclusive_minimum = 0.0)]
    pub exposure_us: Option<f64>,
    /// What is measured on every part; nothing: the parts are scanned only.
    #[serde(default)]
    #[schema(max_items = 50)]
    pub measure: Vec<MeasureDto>,
}

impl From<MeasurementPlan> for MeasurementPlanDto {
    fn from(plan: MeasurementPlan) -> Self {
        let MeasurementPlan { from_mm, to_mm, step_mm, exposure_us, measure } = plan;
        Self { from_mm, to_mm, step_mm, exposure_us, measure: measure.into_iter().filter_map(dto_of).collect() }
    }
}

/// `None` for a tool that this program does not know; such a plan is not accepted.
fn dto_of(input: MeasureInput) -> Option<MeasureDto> {
    let MeasureInput { tool, name, nominal_mm, tolerance_mm, region_mm, seed } = input;
    let tool = ToolDto::from(Tool::from_name(&tool)?);
    Some(MeasureDto { tool, name, nominal_mm, tolerance_mm, region_mm, seed })
}

impl From<MeasurementPlanDto> for MeasurementPlan {
    fn from(dto: MeasurementPlanDto) -> Self {
        let MeasurementPlanDto { from_mm, to_mm, step_mm, exposure_us, measure } = dto;
        Self {
            from_mm,
            to_mm,
            step_mm,
            exposure_us,
            measure: measure.into_iter().map(MeasureInput::from).collect(),
        }
    }
}
